// Pictures as a metric's observer sees them: exposed by the reference, tone-mapped, on a display.
//
// Not what PNG files get (image/tonemap.h): a metric wants one curve that never changes and one
// exposure for both pictures, from the reference alone.
//
//   curve(x)  ACES as fitted by K. Narkowicz ("ACES Filmic Tone Mapping Curve", 2016), with the
//             pre-exposure of 0.6 in it and clamped to [0, 1]: what HDR-FLIP assumes
//   exposure  the 99th percentile of the reference's luminance becomes 1
//
// Any thread.

#ifndef BD_IMAGE_DISPLAY_H
#define BD_IMAGE_DISPLAY_H

#include <stdbool.h>

#include "image/image.h"

// Display-linear, in [0, 1]; 0 for what is negative or NaN.
float bd_display_curve(float exposed);
// The positive x with curve(x) = level, 0 < level < 1.
double bd_display_curve_inverse(double level);

// 0.2126 R + 0.7152 G + 0.0722 B of the first three channels.
double bd_display_luminance(const float rgb[3]);

struct bd_luminance_range {
    double median, high, max; // `high` is the 99th percentile
};
// Over all pixels of an image of 3 channels; of a picture that is black for the most part, median
// and percentile are those of the pixels above 0, and all are 0 where there is none. False if
// there is no memory.
bool bd_luminance_range(const struct bd_image *image, struct bd_luminance_range *out);

// exposure x image through the curve: display-linear RGB. Both have 3 channels and one size.
void bd_display_image(const struct bd_image *image, double exposure, struct bd_image *out);

// IEC 61966-2-1, of [0, 1].
float bd_display_srgb(float linear);

#endif
