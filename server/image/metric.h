// How wrong a picture is, by every measure that bounced reports, each with an interval of 95 %.
//
// I is the picture, A and B two halves of a reference that share no random number, R = (A + B) / 2.
// The halves take the reference's own noise out of the figures; a picture that is a reference
// itself has halves I1 and I2 too, and I = (I1 + I2) / 2. Where a side has no halves, both its
// pictures are the same one, and its noise counts as error.
//
//   d  = (I1 - A)(I2 - B)              unbiased for (I - truth)^2 where the pair of I1 and A is
//                                      independent of that of I2 and B; negative where noise is
//                                      larger
//   n  = ((A - B) + (I1 - I2)) / 2     as noisy as I - R
//   m  = |mean R|,  e = |I - R|
//
//   rel_rmse      sqrt(max(mean d, 0)) / m
//   rmse_max      sqrt(max(mean d, 0)) / max |R|
//   rel_mse       mean of d / (max(|R|, 0.01 m)^2 + (0.01 m)^2)
//   mape          mean of e / (|R| + 0.01 m);                 its floor: of |n| in e's place
//   smape         mean of 2 e / (|I| + |R| + 0.01 m);         its floor: of |n| in e's place
//   signed_error  (mean I - mean R) / m
//   noise_floor   sqrt(mean n^2) / m
//   p99, p999     percentiles over pixels of (mean e over channels) / (mean |R| + 0.01 m), and
//   max_rel       their largest; over_half is the share of pixels above 0.5
//   psnr          dB, of both pictures as image/display.h shows them, sRGB-coded, range 1
//   ssim          of the same pictures' luma; pixels BD_SSIM_MARGIN_PX from every edge, where the
//                 picture has such
//   flip          mean, of the same pictures
//   hdr_flip      mean; hdr_flip_median weighs pixels by their own error, as its authors do
//
// Means are over channels and over the pixels where I is finite; the others are counted, and
// replaced by R where a filter looks at them. Sums are in double and in order: the same input
// gives the same figures. With m = 0 a relative figure is 0 where the picture is black too,
// infinite where it is not.
//
// Any thread; FLIP starts another one meanwhile.

#ifndef BD_IMAGE_METRIC_H
#define BD_IMAGE_METRIC_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "image/bootstrap.h"
#include "image/flip.h"
#include "image/image.h"

// What is better: less, more, nearer to 0; or just for information.
enum bd_metric_goal { BD_GOAL_LESS, BD_GOAL_MORE, BD_GOAL_ZERO, BD_GOAL_NONE };

// X(NAME, name, goal, what it is)
#define BD_METRIC_MAP(X)                                                                           \
    X(REL_RMSE, "rel_rmse", LESS, "relative RMSE")                                                 \
    X(RMSE_MAX, "rmse_max", LESS, "RMSE / largest reference value")                                \
    X(REL_MSE, "rel_mse", LESS, "relative MSE, per pixel")                                         \
    X(MAPE, "mape", LESS, "mean absolute relative error")                                          \
    X(SMAPE, "smape", LESS, "the same, symmetric")                                                 \
    X(SIGNED_ERROR, "signed_error", ZERO, "error of the mean")                                     \
    X(P99, "p99", LESS, "99th percentile of relative error")                                       \
    X(P999, "p999", LESS, "99.9th percentile of relative error")                                   \
    X(OVER_HALF, "over_half", LESS, "share of pixels off by more than 50 %")                       \
    X(PSNR, "psnr", MORE, "PSNR after tone mapping, dB")                                           \
    X(SSIM, "ssim", MORE, "SSIM after tone mapping")                                               \
    X(FLIP, "flip", LESS, "FLIP after tone mapping")                                               \
    X(HDR_FLIP, "hdr_flip", LESS, "HDR-FLIP")                                                      \
    X(NOISE_FLOOR, "noise_floor", LESS, "relative RMSE that is the reference's noise")             \
    X(MAPE_FLOOR, "mape_floor", LESS, "share of mape that noise alone makes")                      \
    X(SMAPE_FLOOR, "smape_floor", LESS, "share of smape that noise alone makes")                   \
    X(MEAN_SQUARE, "mean_square", LESS, "mean squared error")                                      \
    X(MEAN_IMAGE, "mean_image", NONE, "mean of the image")                                         \
    X(MEAN_REFERENCE, "mean_reference", NONE, "mean of the reference")                             \
    X(HDR_FLIP_MEDIAN, "hdr_flip_median", LESS, "HDR-FLIP, weighted median")                       \
    X(MAX_REL, "max_rel", LESS, "largest relative error of a pixel")                               \
    X(MAX_ABS, "max_abs", LESS, "largest error of a sample")                                       \
    X(NONFINITE, "nonfinite", LESS, "pixels that are NaN or infinite")

enum bd_metric {
#define X(name, text, goal, what) BD_METRIC_##name,
    BD_METRIC_MAP(X)
#undef X
        BD_METRIC_COUNT
};

const char *bd_metric_name(enum bd_metric metric);
const char *bd_metric_what(enum bd_metric metric);
enum bd_metric_goal bd_metric_goal(enum bd_metric metric);
// False, and `*out` untouched, if there is none of that name.
bool bd_metric_from_name(const char *name, enum bd_metric *out);

// What a figure holds. A picture property that is counted or looked up, not averaged, has no
// interval.
enum bd_metric_state { BD_METRIC_ABSENT, BD_METRIC_VALUE_ONLY, BD_METRIC_WITH_INTERVAL };

struct bd_metric_input {
    const struct bd_image *reference[2]; // A, B; the same picture twice if there are no halves
    const struct bd_image *image[2];     // likewise
    bool display; // 3 channels of light or colour: psnr, ssim and the flips make sense
    bool shown; // these are what a display shows, 0 to 1: nothing exposes or bends them again, and
                // there is no hdr_flip
    double ppd;   // of the flips: BD_FLIP_PPD_DEFAULT
};

struct bd_metrics {
    struct bd_figure figures[BD_METRIC_COUNT];
    enum bd_metric_state states[BD_METRIC_COUNT];
    struct bd_tiles tiles;
    uint64_t pixel_count; // that were measured
    bool reference_debiased, image_debiased;
    double display_stops; // exposure of psnr, ssim and flip
    struct bd_flip_exposures hdr_exposures;
};

// The floors are absent where no side has halves; everything but `nonfinite` where no pixel of the
// image is finite. BD_ERR_USAGE if sizes or channels differ, BD_ERR_BAD_INPUT with the first place
// if the reference is NaN or infinite somewhere, BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_metrics_measure(const struct bd_metric_input *input, struct bd_metrics *out,
                               struct bd_err_detail *detail);

// Of one pixel, p counted along rows: e averaged over channels, as error maps show it. NaN where
// the picture is not finite.
double bd_metric_pixel_error(const struct bd_metric_input *input, size_t p);

#endif
