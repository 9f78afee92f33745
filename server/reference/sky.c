#include "reference/sky.h"

#include <math.h>
#include <stdlib.h>

#include "reference/vec3f.h"

static const double pi = 3.14159265358979323846;

static const float *texel(const struct bd_sky_map *map, int64_t x, int64_t y)
{
    int64_t width = map->width_px, height = map->height_px;
    x = (x % width + width) % width;
    y = y < 0 ? 0 : y >= height ? height - 1 : y;
    return map->rgb + 3 * (size_t)(y * width + x);
}

static double luminance(const float rgb[3])
{
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

// The most that bilinear filtering can show within a texel, so that no light has a pdf of 0.
static double brightest_near(const struct bd_sky_map *map, int64_t x, int64_t y)
{
    double brightest = 0;
    for (int64_t dy = -1; dy <= 1; dy++)
        for (int64_t dx = -1; dx <= 1; dx++)
            brightest = fmax(brightest, luminance(texel(map, x + dx, y + dy)));
    return 0.5 * (brightest + luminance(texel(map, x, y)));
}

static double row_solid_angle(const struct bd_sky_map *map, uint32_t y)
{
    double step = pi / map->height_px;
    return (cos(y * step) - cos((y + 1) * step)) * 2 * pi / map->width_px;
}

// Cumulates in place; returns the sum.
static double cumulate(double *values, uint32_t count)
{
    double sum = 0;
    for (uint32_t i = 0; i < count; i++) values[i] = sum += values[i];
    for (uint32_t i = 0; i < count; i++) values[i] = sum > 0 ? values[i] / sum : (i + 1.0) / count;
    return sum;
}

static bool build(struct bd_sky *sky, const struct bd_sky_map *map)
{
    for (uint32_t y = 0; y < map->height_px; y++) {
        double *row = sky->columns + (size_t)y * map->width_px;
        for (uint32_t x = 0; x < map->width_px; x++)
            row[x] = brightest_near(map, x, y) * row_solid_angle(map, y);
        sky->rows[y] = cumulate(row, map->width_px);
    }
    return cumulate(sky->rows, map->height_px) > 0;
}

enum bd_err bd_sky_init(struct bd_sky *sky, const struct bd_environment *environment,
                        struct bd_err_detail *detail)
{
    const struct bd_sky_map *map = environment->map;
    const float *factor = environment->radiance;
    *sky = (struct bd_sky){.environment = environment};
    bd_environment_axes(environment, sky->axes);
    sky->shines = factor[0] > 0 || factor[1] > 0 || factor[2] > 0;
    if (!sky->shines || !map) return BD_ERR_OK;
    size_t texel_count = (size_t)map->width_px * map->height_px;
    sky->rows = malloc(map->height_px * sizeof *sky->rows);
    sky->columns = malloc(texel_count * sizeof *sky->columns);
    if (!sky->rows || !sky->columns)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "environment", "no memory for %zu texels",
                          texel_count);
    sky->shines = sky->is_sampled = build(sky, map);
    return BD_ERR_OK;
}

void bd_sky_finish(struct bd_sky *sky)
{
    free(sky->rows);
    free(sky->columns);
    *sky = (struct bd_sky){0};
}

static double along(bd_dvec3 axis, const float d[3])
{
    return axis.x * d[0] + axis.y * d[1] + axis.z * d[2];
}

// Column and row as real numbers, texel (0, 0) from 0 to 1.
static void coordinates(const struct bd_sky *sky, const float direction[3], double *x, double *y)
{
    const struct bd_sky_map *map = sky->environment->map;
    const double d[3] = {along(sky->axes[0], direction), along(sky->axes[1], direction),
                         along(sky->axes[2], direction)};
    double azimuth = atan2(d[0], -d[2]);
    if (azimuth < 0) azimuth += 2 * pi;
    *x = fmin(azimuth / (2 * pi), 1) * map->width_px;
    *y = acos(fmin(fmax(d[1], -1), 1)) / pi * map->height_px;
}

void bd_sky_radiance(const struct bd_sky *sky, const float direction[3], float out[3])
{
    const struct bd_sky_map *map = sky->environment->map;
    bd_vec3f_copy(out, sky->environment->radiance);
    if (!map) return;
    double x, y;
    coordinates(sky, direction, &x, &y);
    int64_t left = (int64_t)floor(x - 0.5), top = (int64_t)floor(y - 0.5);
    float right_share = (float)(x - 0.5 - (double)left), low_share = (float)(y - 0.5 - (double)top);
    const float *a = texel(map, left, top), *b = texel(map, left + 1, top);
    const float *c = texel(map, left, top + 1), *d = texel(map, left + 1, top + 1);
    for (int k = 0; k < 3; k++) {
        float upper = a[k] + (b[k] - a[k]) * right_share;
        float lower = c[k] + (d[k] - c[k]) * right_share;
        out[k] *= upper + (lower - upper) * low_share;
    }
}

// The interval of `cumulated` that holds u; its place within is left in `within`, its probability
// in `probability`.
static uint32_t choose(const double *cumulated, uint32_t count, double u, double *within,
                       double *probability)
{
    uint32_t low = 0, high = count - 1;
    while (low < high) {
        uint32_t middle = (low + high) / 2;
        if (cumulated[middle] > u)
            high = middle;
        else
            low = middle + 1;
    }
    double before = low ? cumulated[low - 1] : 0;
    *probability = cumulated[low] - before;
    *within = fmin((u - before) / *probability, 1);
    return low;
}

void bd_sky_sample(const struct bd_sky *sky, const uint32_t bits[2], float direction[3], float *pdf)
{
    const struct bd_sky_map *map = sky->environment->map;
    double along_y, along_x, row_probability, column_probability;
    uint32_t y = choose(sky->rows, map->height_px, bits[0] * 0x1p-32, &along_y, &row_probability);
    uint32_t x = choose(sky->columns + (size_t)y * map->width_px, map->width_px, bits[1] * 0x1p-32,
                        &along_x, &column_probability);
    // Uniform over the texel's solid angle: in the azimuth and in the cosine.
    double step = pi / map->height_px;
    double top = cos(y * step), bottom = cos((y + 1) * step);
    double cosine = top + (bottom - top) * along_y;
    double sine = sqrt(fmax(1 - cosine * cosine, 0));
    double azimuth = 2 * pi * (x + along_x) / map->width_px;
    const bd_dvec3 x_part = bd_dvec3_scale(sky->axes[0], sine * sin(azimuth));
    const bd_dvec3 y_part = bd_dvec3_scale(sky->axes[1], cosine);
    const bd_dvec3 z_part = bd_dvec3_scale(sky->axes[2], -sine * cos(azimuth));
    const bd_dvec3 d = bd_dvec3_add(x_part, bd_dvec3_add(y_part, z_part));
    bd_vec3f_set(direction, (float)d.x, (float)d.y, (float)d.z);
    *pdf = (float)(row_probability * column_probability / row_solid_angle(map, y));
}

float bd_sky_pdf(const struct bd_sky *sky, const float direction[3])
{
    if (!sky->is_sampled) return 0;
    const struct bd_sky_map *map = sky->environment->map;
    double x_real, y_real;
    coordinates(sky, direction, &x_real, &y_real);
    uint32_t x = (uint32_t)fmin(x_real, map->width_px - 1.0);
    uint32_t y = (uint32_t)fmin(y_real, map->height_px - 1.0);
    const double *row = sky->columns + (size_t)y * map->width_px;
    double column_probability = row[x] - (x ? row[x - 1] : 0);
    double row_probability = sky->rows[y] - (y ? sky->rows[y - 1] : 0);
    return (float)(row_probability * column_probability / row_solid_angle(map, y));
}
