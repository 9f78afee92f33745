#include "image/show.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

// Depths from here on mean that nothing is there: the renderer writes 1e10.
#define DEPTH_NOTHING_M 1e9f

static uint8_t code_of(float v)
{
    if (!(v > 0)) return 0; // NaN too
    return v < 1 ? (uint8_t)(v * 255 + 0.5f) : 255;
}

static void show_normal(const struct bd_image *image, uint8_t *rgb8)
{
    size_t pixel_count = (size_t)image->width_px * image->height_px;
    for (size_t p = 0; p < pixel_count; p++)
        for (uint32_t c = 0; c < 3; c++)
            rgb8[3 * p + c] = code_of(image->pixels[p * image->channel_count + c] * 0.5f + 0.5f);
}

static void show_albedo(const struct bd_image *image, uint8_t *rgb8)
{
    size_t pixel_count = (size_t)image->width_px * image->height_px;
    for (size_t p = 0; p < pixel_count; p++)
        for (uint32_t c = 0; c < 3; c++)
            rgb8[3 * p + c] = bd_srgb8(image->pixels[p * image->channel_count + c]);
}

static void set_grey(uint8_t *rgb8, size_t pixel, uint8_t code)
{
    memset(rgb8 + 3 * pixel, code, 3);
}

static void show_depth(const struct bd_image *image, uint8_t *rgb8)
{
    size_t pixel_count = (size_t)image->width_px * image->height_px;
    float nearest = INFINITY, farthest = -INFINITY;
    for (size_t p = 0; p < pixel_count; p++) {
        float depth_m = image->pixels[p * image->channel_count];
        if (!(depth_m < DEPTH_NOTHING_M)) continue;
        nearest = fminf(nearest, depth_m);
        farthest = fmaxf(farthest, depth_m);
    }
    float range_m = farthest > nearest ? farthest - nearest : 1;
    for (size_t p = 0; p < pixel_count; p++) {
        float depth_m = image->pixels[p * image->channel_count];
        bool there = depth_m < DEPTH_NOTHING_M;
        set_grey(rgb8, p, there ? code_of(1 - 0.9f * ((depth_m - nearest) / range_m)) : 0);
    }
}

static void show_grey(const struct bd_image *image, uint8_t *rgb8)
{
    size_t pixel_count = (size_t)image->width_px * image->height_px;
    for (size_t p = 0; p < pixel_count; p++) set_grey(rgb8, p, code_of(image->pixels[p]));
}

void bd_show_layer(const char *layer, const struct bd_image *image, enum bd_tonemap tonemap,
                   float stops, uint8_t *rgb8)
{
    if (strcmp(layer, "depth") == 0)
        show_depth(image, rgb8);
    else if (image->channel_count == 1)
        show_grey(image, rgb8);
    else if (strcmp(layer, "normal") == 0)
        show_normal(image, rgb8);
    else if (strcmp(layer, "albedo") == 0)
        show_albedo(image, rgb8);
    else
        bd_tonemap_image(image, tonemap, stops, rgb8);
}
