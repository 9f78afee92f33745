// From scene-linear radiance (cd/m^2) to sRGB bytes: exposure, tone curve, transfer function.
//
//   pixel = L * 2^stops          at 0 stops a luminance of 1 cd/m^2 is white in `linear`
//   linear   clamp to 1
//   neutral  Khronos PBR Neutral: exact below 0.8 - 0.04, then compressed towards white without a
//            shift of hue. github.com/KhronosGroup/ToneMapping, PBR_Neutral (specification 1.0)
//   agx      Troy Sobotka's AgX as a sigmoid polynomial of base-2 logarithms between two matrices
//            over Rec.2020: matrices from Eary Chow's AgX_LUT_Gen (AgXBaseRec2020.py, used by
//            Blender 4), polynomial of degree 6 from B. Wrensch, "Minimal AgX Implementation",
//            iolite-engine.com, 2023 (mean squared error 3.67e-6 against the table)
//
// then the sRGB transfer function of IEC 61966-2-1, rounded to the nearest of 256, no dithering.
// Negative and NaN samples are black. Any thread; the same floats give the same bytes.

#ifndef BD_IMAGE_TONEMAP_H
#define BD_IMAGE_TONEMAP_H

#include <stdbool.h>
#include <stdint.h>

#include "image/image.h"

enum bd_tonemap { BD_TONEMAP_NEUTRAL, BD_TONEMAP_AGX, BD_TONEMAP_LINEAR, BD_TONEMAP_COUNT };
#define BD_TONEMAP_WORDS "neutral", "agx", "linear"

// One of the words.
const char *bd_tonemap_name(enum bd_tonemap tonemap);
// False, and `*out` untouched, if there is no such name.
bool bd_tonemap_from_name(const char *name, enum bd_tonemap *out);

#define BD_EXPOSURE_STOPS_MAX 100.0f // of either sign

// The exposure that puts the log mean luminance at middle grey, 0.18:
//
//   stops = log2(0.18) - mean(log2 Y),   Y = 0.2126 R + 0.7152 G + 0.0722 B
//
// over the pixels that are covered (fourth channel, where there is one, above 0), finite and have
// Y > 0; none of them: 0. Rounded down to 1/1024 of a stop and clamped to
// +-BD_EXPOSURE_STOPS_MAX. Exponents are summed as integers, so that an image 2^k times as bright
// gets exactly k stops less.
float bd_exposure_auto(const struct bd_image *image);

// The same row by row; all zeroes at first.
struct bd_exposure_sum {
    int64_t exponents;
    double mantissas; // sum of their log2, but for the last ones,
    double product;   // which are multiplied here; 0: there are none
    int64_t count;
};
void bd_exposure_add_row(struct bd_exposure_sum *sum, const struct bd_image *image, uint32_t row);
float bd_exposure_of(const struct bd_exposure_sum *sum);

// The same from `direct` + `emission`, of one size, where `all` holds light that comes through
// walls: what leaks into a dark room would be shown as bright as day. Where neither has any, the
// exposure of `all`, but never above 0. `emission` may be NULL.
float bd_exposure_auto_lit(const struct bd_image *direct, const struct bd_image *emission,
                           const struct bd_image *all);

// One colour through exposure and curve, still linear, within [0, 1].
void bd_tonemap_apply(enum bd_tonemap tonemap, float exposure_scale, const float rgb[3],
                      float out[3]);

// The nearest of 256 codes for a linear sample; below 0 and NaN: 0, above 1: 255.
uint8_t bd_srgb8(float linear);

// `rgb8`: three bytes a pixel. `image` has 3 or 4 channels (the fourth is not looked at: what is
// not covered is black), or 1, shown as grey.
void bd_tonemap_image(const struct bd_image *image, enum bd_tonemap tonemap, float stops,
                      uint8_t *rgb8);

#endif
