#include "image/display.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"

// (K0 x^2 + K1 x) / (K3 x^2 + K4 x + K5), the numbering of the HDR-FLIP paper.
#define K0 (0.6 * 0.6 * 2.51)
#define K1 (0.6 * 0.03)
#define K3 (0.6 * 0.6 * 2.43)
#define K4 (0.6 * 0.59)
#define K5 0.14

float bd_display_curve(float exposed)
{
    if (!(exposed > 0)) return 0;
    // The quotient's limit, and the square of what is beyond overflows.
    if (exposed > 1e6f) return 1;
    float x = exposed;
    float y = ((float)K0 * x + (float)K1) * x / (((float)K3 * x + (float)K4) * x + (float)K5);
    return y < 1 ? y : 1;
}

double bd_display_curve_inverse(double level)
{
    BD_ASSERT(level > 0 && level < 1);
    double a = K0 - level * K3, b = K1 - level * K4, c = -level * K5;
    return (-b + sqrt(b * b - 4 * a * c)) / (2 * a);
}

double bd_display_luminance(const float rgb[3])
{
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

static int ascending(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

bool bd_luminance_range(const struct bd_image *image, struct bd_luminance_range *out)
{
    BD_ASSERT_CMP(image->channel_count, ==, 3u);
    size_t count = (size_t)image->width_px * image->height_px, dark = 0;
    float *sorted = malloc(count * sizeof *sorted);
    if (!sorted) return false;
    for (size_t p = 0; p < count; p++)
        sorted[p] = (float)bd_display_luminance(image->pixels + 3 * p);
    qsort(sorted, count, sizeof *sorted, ascending);
    *out = (struct bd_luminance_range){0};
    while (dark < count && sorted[dark] <= 0) dark++;
    if (dark < count) {
        // As HDR-FLIP, unless that is 0: no exposure lifts 0 to anything.
        size_t from = 2 * dark >= count ? dark : 0, span = count - 1 - from;
        out->median =
            0.5 * ((double)sorted[from + span / 2] + (double)sorted[from + (span + 1) / 2]);
        out->high = sorted[from + (size_t)(0.99 * (double)span)];
        out->max = sorted[count - 1];
    }
    free(sorted);
    return true;
}

void bd_display_image(const struct bd_image *image, double exposure, struct bd_image *out)
{
    BD_ASSERT(image->channel_count == 3 && out->channel_count == 3);
    size_t count = (size_t)image->width_px * image->height_px * 3;
    for (size_t i = 0; i < count; i++)
        out->pixels[i] = bd_display_curve((float)(exposure * (double)image->pixels[i]));
}

float bd_display_srgb(float linear)
{
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * powf(linear, 1 / 2.4f) - 0.055f;
}
