#include "rays/cutout.h"

#include <math.h>
#include <string.h>

// Two texels along one axis and the share of the second.
struct span {
    uint32_t at[2];
    float share;
};

static uint32_t wrap(double texel, uint32_t size, enum bd_wrap how)
{
    const double last = size - 1.0;
    switch (how) {
    case BD_WRAP_REPEAT:
        texel -= size * floor(texel / size);
        break;
    case BD_WRAP_MIRROR:
        texel -= 2.0 * size * floor(texel / (2.0 * size));
        if (texel > last) texel = 2 * last + 1 - texel;
        break;
    case BD_WRAP_CLAMP:
        break;
    }
    return (uint32_t)fmin(fmax(texel, 0), last);
}

// Coordinates that are no number, or so large that they name no texel, count as 0.
static struct span span_of(float coordinate, uint32_t size, enum bd_wrap how, bool nearest)
{
    const double where = fabsf(coordinate) < 1e9f ? coordinate : 0;
    const double texel = where * size - (nearest ? 0 : 0.5), below = floor(texel);
    return (struct span){{wrap(below, size, how), wrap(below + 1, size, how)},
                         nearest ? 0 : (float)(texel - below)};
}

static float alpha_of_map(const struct bd_scene *scene, const struct bd_texture_ref *map,
                          const float uv[2])
{
    const struct bd_texture *texture = &scene->textures[map->texture];
    const struct bd_picture *picture =
        texture->picture == BD_NONE ? NULL : scene->pictures[texture->picture];
    if (!picture || picture->width_px == 0 || picture->height_px == 0) return 1;
    const float *m = map->uv_transform;
    const float u = m[0] * uv[0] + m[1] * uv[1] + m[2], v = m[3] * uv[0] + m[4] * uv[1] + m[5];
    const struct span x = span_of(u, picture->width_px, texture->wrap_s, texture->nearest);
    const struct span y = span_of(v, picture->height_px, texture->wrap_t, texture->nearest);
    float row[2];
    for (int r = 0; r < 2; r++) {
        const uint8_t *texels = picture->rgba + 4 * (size_t)picture->width_px * y.at[r];
        row[r] = (1 - x.share) * texels[4 * (size_t)x.at[0] + 3] +
                 x.share * texels[4 * (size_t)x.at[1] + 3];
    }
    return ((1 - y.share) * row[0] + y.share * row[1]) / 255;
}

// One of a vertex's streams, of `size` numbers a vertex, at barycentrics.
static void interpolate(const float *stream, uint32_t size, const uint32_t index[3], float u,
                        float v, float *out)
{
    for (uint32_t c = 0; c < size; c++)
        out[c] = (1 - u - v) * stream[size * (size_t)index[0] + c] +
                 u * stream[size * (size_t)index[1] + c] + v * stream[size * (size_t)index[2] + c];
}

float bd_cutout_alpha(const struct bd_scene *scene, const struct bd_primitive *primitive,
                      uint32_t triangle, float u, float v)
{
    const struct bd_material *material = &scene->materials[primitive->material];
    const struct bd_texture_ref *map = &material->base_color_map;
    const uint32_t *index = primitive->index + 3 * (size_t)triangle;
    float alpha = material->base_color[3];
    if (map->texture != BD_NONE && primitive->uv[map->uv_set]) {
        float uv[2];
        interpolate(primitive->uv[map->uv_set], 2, index, u, v, uv);
        alpha *= alpha_of_map(scene, map, uv);
    }
    if (primitive->color) {
        float color[4];
        interpolate(primitive->color, 4, index, u, v, color);
        alpha *= color[3];
    }
    return alpha;
}

// Jarzynski and Olano 2020: PCG in one dimension.
static uint32_t stir(uint32_t x)
{
    x = x * 747796405u + 2891336453u;
    x = ((x >> ((x >> 28) + 4)) ^ x) * 277803737u;
    return x >> 22 ^ x;
}

static uint32_t bits_of(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

float bd_rays_chance(const float a[3], const float b[3], uint32_t triangle)
{
    uint32_t hash = stir(triangle);
    for (int c = 0; c < 3; c++) hash = stir(hash ^ bits_of(a[c]));
    for (int c = 0; c < 3; c++) hash = stir(hash ^ bits_of(b[c]));
    return (float)(hash >> 8) * 0x1p-24f;
}
