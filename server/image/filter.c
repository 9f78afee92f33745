#include "image/filter.h"

#include <math.h>
#include <string.h>

#include "base/assert.h"

double bd_kernel_gaussian(double sigma_px, int radius, struct bd_kernel *out)
{
    BD_ASSERT_CMP(radius, <=, BD_FILTER_RADIUS_MAX);
    double exponent = 1 / (2 * sigma_px * sigma_px);
    while (radius > 0 && exp(-radius * radius * exponent) < 1e-9) radius--;
    double sum = 0;
    for (int x = -radius; x <= radius; x++) sum += exp(-x * x * exponent);
    out->radius = radius;
    for (int x = -radius; x <= radius; x++)
        out->weights[x + radius] = (float)(exp(-x * x * exponent) / sum);
    return sum;
}

static void add_scaled(const float *restrict in, size_t count, float weight, float *restrict out)
{
    for (size_t i = 0; i < count; i++) out[i] += weight * in[i];
}

// One tap at a time over the inside of a row, which vectorizes; the ends sample by sample.
static void filter_row(const float *in, size_t width, const struct bd_kernel *kernel, float *out)
{
    size_t radius = (size_t)kernel->radius;
    memset(out, 0, width * sizeof *out);
    size_t inside = width > 2 * radius ? width - 2 * radius : 0;
    for (size_t k = 0; k <= 2 * radius && inside; k++)
        add_scaled(in + k, inside, kernel->weights[k], out + radius);
    for (size_t x = 0; x < width; x++) {
        if (inside && x == radius) x += inside;
        for (size_t k = 0; k <= 2 * radius; k++) {
            size_t at = x + k < radius ? 0 : x + k - radius;
            out[x] += kernel->weights[k] * in[at < width ? at : width - 1];
        }
    }
}

void bd_filter_rows(const float *in, struct bd_plane_size size, const struct bd_kernel *kernel,
                    float *out)
{
    for (size_t y = 0; y < size.height_px; y++)
        filter_row(in + y * size.width_px, size.width_px, kernel, out + y * size.width_px);
}

void bd_filter_columns(const float *in, struct bd_plane_size size, const struct bd_kernel *kernel,
                       float *out)
{
    size_t radius = (size_t)kernel->radius;
    memset(out, 0, size.width_px * size.height_px * sizeof *out);
    for (size_t y = 0; y < size.height_px; y++) {
        for (size_t k = 0; k <= 2 * radius; k++) {
            size_t at = y + k < radius ? 0 : y + k - radius;
            if (at >= size.height_px) at = size.height_px - 1;
            add_scaled(in + at * size.width_px, size.width_px, kernel->weights[k],
                       out + y * size.width_px);
        }
    }
}

void bd_filter_both(const float *in, struct bd_plane_size size, const struct bd_kernel *kernel,
                    float *scratch, float *out)
{
    bd_filter_rows(in, size, kernel, scratch);
    bd_filter_columns(scratch, size, kernel, out);
}
