// The parts of the metrics that are sums over pixels: a pixel's terms, and figures of their sums.
// A part of image/metric.c. Any thread.

#ifndef BD_IMAGE_METRIC_SUMS_H
#define BD_IMAGE_METRIC_SUMS_H

#include "image/metric.h"

enum bd_metric_term {
    BD_TERM_PIXELS,
    BD_TERM_DEBIASED, // d, and all below likewise averaged over channels
    BD_TERM_NOISE,    // n^2
    BD_TERM_IMAGE,
    BD_TERM_REFERENCE,
    BD_TERM_REL_MSE,
    BD_TERM_MAPE,
    BD_TERM_MAPE_FLOOR,
    BD_TERM_SMAPE,
    BD_TERM_SMAPE_FLOOR,
    BD_TERM_OVER_HALF,
    BD_TERM_DISPLAY_SQUARE, // of display values' differences
    BD_TERM_FLIP,
    BD_TERM_HDR_FLIP,
    BD_TERM_SSIM,
    BD_TERM_SSIM_PIXELS,
    BD_TERM_COUNT,
};

// The figures before this one are of sums; p99 and p999 among them are left at 0.
#define BD_METRIC_SUM_COUNT (BD_METRIC_MEAN_REFERENCE + 1)

// What all terms look at; measured before any of them.
struct bd_metric_scale {
    double mean, max; // m and max |R|
};

struct bd_metric_pixel {
    uint32_t channel_count;
    const float *reference[2], *image[2];
};

struct bd_metric_pixel bd_metric_pixel_at(const struct bd_metric_input *input, size_t p);
bool bd_metric_pixel_is_finite(const struct bd_metric_pixel *pixel);
double bd_metric_pixel_mean_error(const struct bd_metric_pixel *pixel); // e

// Adds a finite pixel to a tile's sums, all but the display's terms, and returns its relative
// error.
double bd_metric_add(const struct bd_metric_pixel *pixel, const struct bd_metric_scale *scale,
                     double sums[BD_TERM_COUNT]);

// `user` is a struct bd_metric_scale; of struct bd_statistics.
void bd_metric_evaluate(const double *sums, const void *user, double *figures);

#endif
