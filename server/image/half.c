#include "image/half.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HALF_LARGEST   0x7bffu
#define HALF_ONE       0x3c00u
#define CHANNEL_COUNT  4
#define HALF_MAX       65504.0f
#define HALF_MIN       0x1p-14f // of the normal ones
#define HALF_SMALLEST  0x1p-24f

uint16_t bd_half_from_float(float value)
{
    if (isnan(value)) return 0;
    uint16_t sign = signbit(value) ? 0x8000 : 0;
    float size = fabsf(value);
    if (size >= HALF_MAX) return sign | HALF_LARGEST;
    // Below the normal ones a half counts its smallest step; rintf rounds ties to even.
    if (size < HALF_MIN) return sign | (uint16_t)rintf(size / HALF_SMALLEST);
    int exponent;
    float mantissa = frexpf(size, &exponent); // [0.5, 1[
    uint32_t steps = (uint32_t)rintf(mantissa * 2048); // 1024 to 2048, which carries over
    uint32_t bits = (uint32_t)(exponent + 14) * 1024 + steps - 1024;
    return sign | (uint16_t)(bits < HALF_LARGEST ? bits : HALF_LARGEST);
}

static void put(uint8_t *to, uint16_t half)
{
    to[0] = (uint8_t)half;
    to[1] = (uint8_t)(half >> 8);
}

static void put_pixel(uint8_t *to, const float *pixel, uint32_t channel_count)
{
    for (uint32_t c = 0; c < 3; c++)
        put(to + 2 * c, bd_half_from_float(pixel[channel_count < 3 ? 0 : c]));
    put(to + 6, channel_count == CHANNEL_COUNT ? bd_half_from_float(pixel[3]) : HALF_ONE);
}

enum bd_err bd_half_encode(const struct bd_image *image, struct bd_bytes *out,
                           struct bd_err_detail *detail)
{
    size_t pixels = (size_t)image->width_px * image->height_px;
    out->data = malloc(pixels * CHANNEL_COUNT * 2);
    if (!out->data)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory for the picture");
    out->size_bytes = pixels * CHANNEL_COUNT * 2;
    for (size_t p = 0; p < pixels; p++)
        put_pixel(out->data + p * CHANNEL_COUNT * 2, image->pixels + p * image->channel_count,
                  image->channel_count);
    return BD_ERR_OK;
}
