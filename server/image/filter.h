// Separable filters over planes of floats; beyond an edge its last sample repeats. Any thread.

#ifndef BD_IMAGE_FILTER_H
#define BD_IMAGE_FILTER_H

#include <stddef.h>
#include <stdint.h>

#define BD_FILTER_RADIUS_MAX 64

struct bd_kernel {
    int radius;                                  // at most BD_FILTER_RADIUS_MAX
    float weights[2 * BD_FILTER_RADIUS_MAX + 1]; // from -radius to radius
};

struct bd_plane_size {
    size_t width_px, height_px;
};

// exp(-x^2 / (2 sigma^2)) over -radius..radius with sum 1. Taps below 1e-9 of the middle one are
// left off. Returns the sum before it was made 1.
double bd_kernel_gaussian(double sigma_px, int radius, struct bd_kernel *out);

// `out` must not overlap `in`.
void bd_filter_rows(const float *in, struct bd_plane_size size, const struct bd_kernel *kernel,
                    float *out);
void bd_filter_columns(const float *in, struct bd_plane_size size, const struct bd_kernel *kernel,
                       float *out);
// Rows, then columns of the same kernel; `scratch` is a plane too. `out` may be `in`.
void bd_filter_both(const float *in, struct bd_plane_size size, const struct bd_kernel *kernel,
                    float *scratch, float *out);

#endif
