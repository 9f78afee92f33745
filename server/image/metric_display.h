// The metrics that look at pictures as a display shows them, as one plane of errors each. A part
// of image/metric.c. Any thread.

#ifndef BD_IMAGE_METRIC_DISPLAY_H
#define BD_IMAGE_METRIC_DISPLAY_H

#include "image/metric.h"

// Planes of one float a pixel; owned.
struct bd_metric_display {
    float *square; // (I - R)^2 of sRGB-coded values, averaged over channels
    float *ssim, *flip, *hdr_flip;
    double exposure; // of all but `hdr_flip`
    struct bd_flip_exposures hdr_exposures;
};

// `input` has `display` set and is checked. Pixels of the image that are not finite count as equal
// to the reference's. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_metric_display_measure(const struct bd_metric_input *input,
                                      struct bd_metric_display *out, struct bd_err_detail *detail);
void bd_metric_display_finish(struct bd_metric_display *display);

#endif
