#include "lights/map.h"

#include <math.h>
#include <pthread.h>
#include <stddef.h>

// Two texels along one axis and the share of the second.
struct span {
    uint32_t at[2];
    float share;
};

static uint32_t wrap(double texel, uint32_t size, enum bd_wrap how)
{
    const double last = size - 1.0;
    if (how == BD_WRAP_REPEAT) texel -= size * floor(texel / size);
    if (how == BD_WRAP_MIRROR) {
        texel -= 2.0 * size * floor(texel / (2.0 * size));
        if (texel > last) texel = 2 * last + 1 - texel;
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

// IEC 61966-2-1, of every byte.
static float linear[256], as_it_is[256];
static pthread_once_t linear_once = PTHREAD_ONCE_INIT;

static void fill_linear(void)
{
    for (int byte = 0; byte < 256; byte++) {
        const float c = as_it_is[byte] = (float)byte / 255;
        linear[byte] = c <= 0.04045f ? c / 12.92f : powf((c + 0.055f) / 1.055f, 2.4f);
    }
}

static struct bd_map_texel texel_at(const struct bd_picture *picture, const float meaning[256],
                                    uint32_t x, uint32_t y)
{
    const uint8_t *rgba = picture->rgba + 4 * ((size_t)picture->width_px * y + x);
    return (struct bd_map_texel){f3_of(meaning[rgba[0]], meaning[rgba[1]], meaning[rgba[2]]),
                                 (float)rgba[3] / 255};
}

static struct bd_map_texel between(struct bd_map_texel a, struct bd_map_texel b, float share)
{
    return (struct bd_map_texel){f3_between(a.rgb, b.rgb, share),
                                 a.alpha + (b.alpha - a.alpha) * share};
}

void bd_stream_at(const float *stream, uint32_t size, const uint32_t index[3], float u, float v,
                  float *out)
{
    for (uint32_t c = 0; c < size; c++)
        out[c] = (1 - u - v) * stream[size * (size_t)index[0] + c] +
                 u * stream[size * (size_t)index[1] + c] + v * stream[size * (size_t)index[2] + c];
}

static const struct bd_picture *picture_of(const struct bd_scene *scene,
                                           const struct bd_texture_ref *map)
{
    const int32_t picture = scene->textures[map->texture].picture;
    return picture == BD_NONE ? NULL : scene->pictures[picture];
}

static void coordinates_at(const struct bd_texture_ref *map, const struct bd_primitive *primitive,
                           const uint32_t index[3], float u, float v, float out[2])
{
    float uv[2];
    bd_stream_at(primitive->uv[map->uv_set], 2, index, u, v, uv);
    const float *m = map->uv_transform;
    out[0] = m[0] * uv[0] + m[1] * uv[1] + m[2];
    out[1] = m[3] * uv[0] + m[4] * uv[1] + m[5];
}

// `meaning` of bytes is known from the first call on.
static struct bd_map_texel map_at(const struct bd_scene *scene, const struct bd_texture_ref *map,
                                  const struct bd_primitive *primitive, const uint32_t index[3],
                                  float u, float v, const float meaning[256])
{
    const struct bd_map_texel white = {f3_of(1, 1, 1), 1};
    if (map->texture == BD_NONE || !primitive->uv[map->uv_set]) return white;
    const struct bd_texture *texture = &scene->textures[map->texture];
    const struct bd_picture *picture = picture_of(scene, map);
    if (!picture || picture->width_px == 0 || picture->height_px == 0) return white;
    float uv[2];
    pthread_once(&linear_once, fill_linear);
    coordinates_at(map, primitive, index, u, v, uv);
    const struct span x = span_of(uv[0], picture->width_px, texture->wrap_s, texture->nearest);
    const struct span y = span_of(uv[1], picture->height_px, texture->wrap_t, texture->nearest);
    const struct bd_map_texel above =
        between(texel_at(picture, meaning, x.at[0], y.at[0]),
                texel_at(picture, meaning, x.at[1], y.at[0]), x.share);
    const struct bd_map_texel below =
        between(texel_at(picture, meaning, x.at[0], y.at[1]),
                texel_at(picture, meaning, x.at[1], y.at[1]), x.share);
    return between(above, below, y.share);
}

struct bd_map_texel bd_map_at(const struct bd_scene *scene, const struct bd_texture_ref *map,
                              const struct bd_primitive *primitive, const uint32_t index[3],
                              float u, float v)
{
    return map_at(scene, map, primitive, index, u, v, linear);
}

struct bd_map_texel bd_map_data_at(const struct bd_scene *scene, const struct bd_texture_ref *map,
                                   const struct bd_primitive *primitive, const uint32_t index[3],
                                   float u, float v)
{
    return map_at(scene, map, primitive, index, u, v, as_it_is);
}

// --- ranges -------------------------------------------------------------------------------------

#define RANGE_SIDE_MAX 64u

// Along an axis.
struct stretch {
    double first;   // texel that filtering may read
    uint32_t count; // of those; 0: too many, or none that can be told
    float texels;   // between the coordinates
};

static struct stretch stretch_of(const float at[3], uint32_t size, bool nearest)
{
    const float low = fminf(at[0], fminf(at[1], at[2])), high = fmaxf(at[0], fmaxf(at[1], at[2]));
    const float texels = (high - low) * (float)size;
    const bool are_told = fabsf(at[0]) < 1e6f && fabsf(at[1]) < 1e6f && fabsf(at[2]) < 1e6f;
    if (!are_told) return (struct stretch){.texels = INFINITY};
    const double off = nearest ? 0 : 0.5, first = floor((double)low * size - off);
    const double count = floor((double)high * size + off) - first + 1;
    return (struct stretch){first, count > RANGE_SIDE_MAX ? 0 : (uint32_t)count, texels};
}

static struct bd_map_range range_within(const struct bd_picture *picture,
                                        const struct bd_texture *texture, struct stretch x,
                                        struct stretch y)
{
    uint32_t columns[RANGE_SIDE_MAX];
    uint8_t most = 0;
    float sum = 0;
    for (uint32_t i = 0; i < x.count; i++)
        columns[i] = wrap(x.first + i, picture->width_px, texture->wrap_s);
    for (uint32_t j = 0; j < y.count; j++) {
        const uint32_t row = wrap(y.first + j, picture->height_px, texture->wrap_t);
        for (uint32_t i = 0; i < x.count; i++) {
            const uint8_t *rgba =
                picture->rgba + 4 * ((size_t)picture->width_px * row + columns[i]);
            const uint8_t red_green = rgba[0] > rgba[1] ? rgba[0] : rgba[1];
            const uint8_t brightest = red_green > rgba[2] ? red_green : rgba[2];
            if (brightest > most) most = brightest;
            sum += linear[brightest];
        }
    }
    const uint32_t count = x.count * y.count;
    return (struct bd_map_range){count > 0, linear[most], count > 0 ? sum / (float)count : 0,
                                 fmaxf(x.texels, y.texels)};
}

struct bd_map_range bd_map_range(const struct bd_scene *scene, const struct bd_texture_ref *map,
                                 const struct bd_primitive *primitive, const uint32_t index[3],
                                 const float u[3], const float v[3])
{
    const struct bd_map_range white = {true, 1, 1, 0};
    if (map->texture == BD_NONE || !primitive->uv[map->uv_set]) return white;
    const struct bd_texture *texture = &scene->textures[map->texture];
    const struct bd_picture *picture = picture_of(scene, map);
    if (!picture || picture->width_px == 0 || picture->height_px == 0) return white;
    float s[3], t[3], uv[2];
    pthread_once(&linear_once, fill_linear);
    for (int c = 0; c < 3; c++) {
        coordinates_at(map, primitive, index, u[c], v[c], uv);
        s[c] = uv[0], t[c] = uv[1];
    }
    return range_within(picture, texture, stretch_of(s, picture->width_px, texture->nearest),
                        stretch_of(t, picture->height_px, texture->nearest));
}
