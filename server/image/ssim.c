#include "image/ssim.h"

#include <stdlib.h>

enum { MEAN_A, MEAN_B, SQUARE_A, SQUARE_B, PRODUCT, SCRATCH, PLANE_COUNT };

// Moments are taken about the middle of the range: a flat region's variance, a difference of nearly
// equal numbers, then keeps twice the digits at the range's ends.
#define MIDDLE 0.5f

static float similarity(float mean_a, float mean_b, float square_a, float square_b, float product)
{
    const float c1 = 0.01f * 0.01f, c2 = 0.03f * 0.03f;
    float variances = square_a - mean_a * mean_a + (square_b - mean_b * mean_b);
    float covariance = product - mean_a * mean_b;
    mean_a += MIDDLE;
    mean_b += MIDDLE;
    float means = mean_a * mean_a + mean_b * mean_b;
    return (2 * mean_a * mean_b + c1) * (2 * covariance + c2) / ((means + c1) * (variances + c2));
}

enum bd_err bd_ssim(const float *a, const float *b, struct bd_plane_size size, float *map,
                    struct bd_err_detail *detail)
{
    size_t count = size.width_px * size.height_px;
    float *planes = malloc(count * PLANE_COUNT * sizeof *planes);
    if (!planes) return bd_err_set(detail, BD_ERR_NO_MEMORY, "ssim", "no memory for SSIM");
    float *at[PLANE_COUNT];
    for (int i = 0; i < PLANE_COUNT; i++) at[i] = planes + (size_t)i * count;
    for (size_t p = 0; p < count; p++) {
        float u = a[p] - MIDDLE, v = b[p] - MIDDLE;
        at[MEAN_A][p] = u;
        at[MEAN_B][p] = v;
        at[SQUARE_A][p] = u * u;
        at[SQUARE_B][p] = v * v;
        at[PRODUCT][p] = u * v;
    }
    struct bd_kernel window;
    bd_kernel_gaussian(1.5, BD_SSIM_MARGIN_PX, &window);
    for (int i = MEAN_A; i <= PRODUCT; i++)
        bd_filter_both(at[i], size, &window, at[SCRATCH], at[i]);
    for (size_t p = 0; p < count; p++)
        map[p] = similarity(at[MEAN_A][p], at[MEAN_B][p], at[SQUARE_A][p], at[SQUARE_B][p],
                            at[PRODUCT][p]);
    free(planes);
    return BD_ERR_OK;
}
