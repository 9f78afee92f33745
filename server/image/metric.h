// How wrong an image is, measured against two independent halves of a reference, so that the
// reference's own noise drops out instead of being counted as error.
//
// I is the image, A and B the halves (same samples each, different seeds), R = (A + B) / 2:
//
//   debiased squared error   d = (I - A)(I - B), unbiased for (I - truth)^2 where I is
//                            independent of A and B; may come out below 0 where the error is
//                            smaller than the noise
//   relative RMSE            sqrt(max(mean d, 0)) / mean R
//   signed error             (mean I - mean R) / mean R
//   noise floor              sqrt(mean (A - B)^2 / 4) / mean R
//
// Means are over pixels and channels. Sums are in double, in order: the same input gives the same
// figures. Any thread.

#ifndef BD_IMAGE_METRIC_H
#define BD_IMAGE_METRIC_H

#include <stdint.h>

#include "base/err.h"
#include "image/image.h"

struct bd_metric {
    double rel_rmse;
    double mean_square; // mean d, signed
    double signed_error;
    double noise_floor;
    double max_abs; // largest |I - R| of one sample
    double mean_image, mean_reference;
    uint64_t sample_count;    // pixels x channels that were measured
    uint64_t nonfinite_count; // samples left out because I, A or B is NaN or infinite
};

// BD_ERR_USAGE if sizes or channels differ. With mean R = 0 the relative figures are 0 where the
// image is black too, infinite where it is not.
BD_MUST_CHECK
enum bd_err bd_metric_measure(const struct bd_image *image, const struct bd_image *half_a,
                              const struct bd_image *half_b, struct bd_metric *out,
                              struct bd_fault *fault);

#endif
