#include "reference/texture.h"

#include <math.h>
#include <stddef.h>

#include "reference/surface.h"
#include "reference/texture_srgb.h"
#include "reference/vec3f.h"

float bd_srgb_to_linear(uint8_t value)
{
    return bd_srgb_table[value];
}

// Where along one axis a coordinate falls: two texels and the share of the second.
struct span {
    uint32_t first, second;
    float share;
};

// floorf without a call. From 2^23 on a float has no fraction; NaN stays.
static float floor_of(float x)
{
    if (!(fabsf(x) < 0x1p23f)) return x;
    float whole = (float)(int32_t)x;
    return whole - (float)(x < whole);
}

// Brings a coordinate near enough to 0 for integers, without changing which texels it means.
static float reduce(float u, enum bd_wrap wrap)
{
    float reduced = 0;
    switch (wrap) {
    case BD_WRAP_REPEAT:
        reduced = u - floor_of(u);
        break;
    case BD_WRAP_MIRROR:
        reduced = u - 2 * floor_of(0.5f * u);
        break;
    case BD_WRAP_CLAMP:
        reduced = bd_minf(bd_maxf(u, 0), 1);
        break;
    }
    return reduced >= 0 && reduced <= 2 ? reduced : 0; // not finite: 0
}

// `i` is at most one period outside.
static uint32_t wrap_index(int32_t i, int32_t size, enum bd_wrap wrap)
{
    switch (wrap) {
    case BD_WRAP_REPEAT:
        i = i < 0 ? i + size : i;
        i = i >= size ? i - size : i;
        break;
    case BD_WRAP_MIRROR:
        i = i < 0 ? -1 - i : i;
        i = i >= 2 * size ? i - 2 * size : i;
        i = i >= size ? 2 * size - 1 - i : i;
        break;
    case BD_WRAP_CLAMP:
        i = i < 0 ? 0 : i;
        i = i >= size ? size - 1 : i;
        break;
    }
    return (uint32_t)i;
}

static struct span span_of(float u, uint32_t size, enum bd_wrap wrap, bool nearest)
{
    float x = reduce(u, wrap) * (float)size - (nearest ? 0 : 0.5f);
    float below = floor_of(x);
    int32_t i = (int32_t)below;
    struct span span = {wrap_index(i, (int32_t)size, wrap), 0, 0};
    if (nearest) {
        span.second = span.first;
        return span;
    }
    span.second = wrap_index(i + 1, (int32_t)size, wrap);
    span.share = x - below;
    return span;
}

// The four texels around a point and their weights, which add up to 1.
struct footprint {
    const uint8_t *texel[4];
    float weight[4];
};

static bool footprint_of(const struct bd_scene *scene, const struct bd_texture *texture, float u,
                         float v, struct footprint *out)
{
    if (texture->picture == BD_NONE) return false;
    const struct bd_picture *picture = scene->pictures[texture->picture];
    if (!picture || picture->width_px == 0 || picture->height_px == 0) return false;
    struct span x = span_of(u, picture->width_px, texture->wrap_s, texture->nearest);
    struct span y = span_of(v, picture->height_px, texture->wrap_t, texture->nearest);
    const uint8_t *upper = picture->rgba + 4 * (size_t)picture->width_px * y.first;
    const uint8_t *lower = picture->rgba + 4 * (size_t)picture->width_px * y.second;
    *out = (struct footprint){
        {upper + 4 * (size_t)x.first, upper + 4 * (size_t)x.second, lower + 4 * (size_t)x.first,
         lower + 4 * (size_t)x.second},
        {(1 - x.share) * (1 - y.share), x.share * (1 - y.share), (1 - x.share) * y.share,
         x.share * y.share},
    };
    return true;
}

static float linear_channel(const struct footprint *f, int channel)
{
    float sum = 0;
    for (int t = 0; t < 4; t++) sum += f->weight[t] * (float)f->texel[t][channel];
    return sum * (1 / 255.0f);
}

static float srgb_channel(const struct footprint *f, int channel)
{
    float sum = 0;
    for (int t = 0; t < 4; t++) sum += f->weight[t] * bd_srgb_table[f->texel[t][channel]];
    return sum;
}

void bd_texture_at(const struct bd_scene *scene, const struct bd_texture *texture, bool srgb,
                   float u, float v, float out[4])
{
    struct footprint f;
    if (!footprint_of(scene, texture, u, v, &f)) {
        out[0] = out[1] = out[2] = out[3] = 1;
        return;
    }
    for (int c = 0; c < 3; c++) out[c] = srgb ? srgb_channel(&f, c) : linear_channel(&f, c);
    out[3] = linear_channel(&f, 3);
}

float bd_texture_alpha_at(const struct bd_scene *scene, const struct bd_texture *texture, float u,
                          float v)
{
    struct footprint f;
    return footprint_of(scene, texture, u, v, &f) ? linear_channel(&f, 3) : 1;
}
