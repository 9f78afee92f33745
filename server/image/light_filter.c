#include "image/light_filter.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/huge_pages.h"
#include "kernel/all_channels.h"

// What reflects less is not divided by less: its light is noise over next to nothing.
#define ALBEDO_LEAST    0.02f
#define PLANE_TOLERANCE 0.01f
// Blur as a part of the variance that smoothing takes off: 0 to .2 in four scenes with 2 to 32
// rays.
#define BLUR_SHARE      0.1f
#define SIGMAS          2.0f // C
#define LEVELS_MAX      8
#define RADIUS          2 // of the kernel, in steps of the level

enum plane {
    // What does not change: the surface that is seen.
    NORMAL_X,
    NORMAL_Y,
    NORMAL_Z,
    DEPTH,
    NEARNESS,   // 1 / depth
    NEARNESS_X, // its gradient, of a pixel
    NEARNESS_Y,
    VARIANCE, // of a half's strength
    // Of each half, twice over: what a level reads and what it writes.
    LIGHT,
    LUMINANCE_A = LIGHT + 12,
    LUMINANCE_B,
    PLANE_COUNT,
};

struct bd_light_filter {
    struct bd_light_filter_inputs inputs;
    int width, height;
    uint32_t level_count;
    float variance_part; // of the noise's, that edges may drown in
    float scale; // a power of two near 1 / the mean: how bright it is costs no digits
    bool is_needed;
    float *planes; // PLANE_COUNT, row by row
};

static float *row_of(const struct bd_light_filter *f, int plane, int y)
{
    return f->planes + ((size_t)plane * (size_t)f->height + (size_t)y) * (size_t)f->width;
}

static int light_plane(uint32_t level, int half, int channel)
{
    return LIGHT + (int)(level % 2) * 6 + half * 3 + channel;
}

// --- making one -----------------------------------------------------------------------------

static uint32_t level_count_of(uint32_t height_px)
{
    uint32_t count = 3;
    for (uint32_t rows = 384; rows <= height_px && count < LEVELS_MAX; rows *= 2) count++;
    return count;
}

// By the mean of the logarithm: a single sample that is huge does not make the rest next to nothing.
static void look_at_light(struct bd_light_filter *f)
{
    const float *a = f->inputs.half[0]->pixels, *b = f->inputs.half[1]->pixels;
    const size_t count = 3 * (size_t)f->width * (size_t)f->height;
    int64_t exponents = 0, lit = 0;
    for (size_t i = 0; i < count; i++) {
        int exponent;
        if (a[i] != b[i]) f->is_needed = true;
        if (a[i] == 0 || !isfinite(a[i])) continue;
        frexpf(a[i], &exponent);
        exponents += exponent;
        lit++;
    }
    // Within what a float and its inverse hold.
    const int64_t mean = lit ? exponents / lit : 0;
    f->scale = ldexpf(1, -(int)(mean > 120 ? 120 : mean < -120 ? -120 : mean));
}

enum bd_err bd_light_filter_create(const struct bd_light_filter_inputs *inputs,
                                   struct bd_light_filter **out, struct bd_err_detail *detail)
{
    const struct bd_image *light = inputs->half[0];
    struct bd_light_filter *f = calloc(1, sizeof *f);
    BD_ASSERT(f);
    f->inputs = *inputs;
    f->width = (int)light->width_px;
    f->height = (int)light->height_px;
    f->level_count = inputs->level_count ? inputs->level_count : level_count_of(light->height_px);
    BD_ASSERT_CMP(f->level_count, <=, LEVELS_MAX);
    f->variance_part = inputs->variance_part > 0 ? inputs->variance_part : 1;
    look_at_light(f);
    if (f->is_needed)
        f->planes = bd_huge_pages_alloc(PLANE_COUNT * (size_t)f->width * (size_t)f->height *
                                        sizeof *f->planes);
    if (f->is_needed && !f->planes) {
        free(f);
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory to filter %ux%u pixels",
                          light->width_px, light->height_px);
    }
    *out = f;
    return BD_ERR_OK;
}

void bd_light_filter_destroy(struct bd_light_filter **filter)
{
    if (!*filter) return;
    free((*filter)->planes);
    free(*filter);
    *filter = NULL;
}

bool bd_light_filter_is_needed(const struct bd_light_filter *filter)
{
    return filter->is_needed;
}

// --- the surface and its light ----------------------------------------------------------------

// Channels exchanged are channels exchanged, to the last bit (kernel/all_channels.h).
static float strength(float r, float g, float b)
{
    return all_channels(f3_of(r, g, b)) / 3;
}

static float reflectance(const struct bd_light_filter *f, int x, int y, int channel)
{
    if (!f->inputs.albedo) return 1;
    const float albedo = bd_image_at(f->inputs.albedo, (uint32_t)x, (uint32_t)y)[channel];
    return albedo > ALBEDO_LEAST ? albedo : ALBEDO_LEAST;
}

static bool has_surface(const struct bd_light_filter *f, uint32_t x, uint32_t y)
{
    const float *n = bd_image_at(f->inputs.normal, x, y);
    const float depth = *bd_image_at(f->inputs.depth, x, y);
    return n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 0 && depth > 0 && isfinite(1 / depth);
}

// What each half shows of the light that falls there; false where it is no number, or so large that
// its square is none.
static bool fallen_light(const struct bd_light_filter *f, int x, int y, float out[2][3])
{
    const float most = 1e18f;
    bool usable = true;
    for (int half = 0; half < 2; half++) {
        const float *light = bd_image_at(f->inputs.half[half], (uint32_t)x, (uint32_t)y);
        for (int c = 0; c < 3; c++) {
            out[half][c] = light[c] * f->scale / reflectance(f, x, y, c);
            usable = usable && fabsf(out[half][c]) < most;
        }
    }
    return usable;
}

// What is not usable has no normal, and so no weight anywhere.
static void prepare_pixel(struct bd_light_filter *f, int x, int y)
{
    float light[2][3];
    const bool usable = has_surface(f, (uint32_t)x, (uint32_t)y) && fallen_light(f, x, y, light);
    const float *n = bd_image_at(f->inputs.normal, (uint32_t)x, (uint32_t)y);
    const float depth = usable ? *bd_image_at(f->inputs.depth, (uint32_t)x, (uint32_t)y) : 1;
    if (!usable) memset(light, 0, sizeof light);
    for (int c = 0; c < 3; c++) row_of(f, NORMAL_X + c, y)[x] = usable ? n[c] : 0;
    row_of(f, DEPTH, y)[x] = depth;
    row_of(f, NEARNESS, y)[x] = 1 / depth;
    for (int half = 0; half < 2; half++) {
        for (int c = 0; c < 3; c++) row_of(f, light_plane(0, half, c), y)[x] = light[half][c];
        row_of(f, LUMINANCE_A + half, y)[x] =
            strength(light[half][0], light[half][1], light[half][2]);
    }
}

static void prepare(struct bd_light_filter *f, int y)
{
    for (int x = 0; x < f->width; x++) prepare_pixel(f, x, y);
}

// The smaller of the two one-sided differences: across an edge it stays on its own side.
static float slope(float before, float at, float after, bool has_before, bool has_after)
{
    const float back = at - before, ahead = after - at;
    if (!has_before) return has_after ? ahead : 0;
    if (!has_after) return back;
    return fabsf(back) < fabsf(ahead) ? back : ahead;
}

static void differentiate(struct bd_light_filter *f, int y)
{
    const bool has_above = y > 0, has_below = y + 1 < f->height;
    const float *s = row_of(f, NEARNESS, y);
    const float *above = row_of(f, NEARNESS, has_above ? y - 1 : y);
    const float *below = row_of(f, NEARNESS, has_below ? y + 1 : y);
    float *along_x = row_of(f, NEARNESS_X, y), *along_y = row_of(f, NEARNESS_Y, y);
    for (int x = 0; x < f->width; x++) {
        const bool has_left = x > 0, has_right = x + 1 < f->width;
        along_x[x] =
            slope(s[has_left ? x - 1 : x], s[x], s[has_right ? x + 1 : x], has_left, has_right);
        along_y[x] = slope(above[x], s[x], below[x], has_above, has_below);
    }
}

// --- weights ------------------------------------------------------------------------------------

static const float b3[RADIUS + 1] = {6 / 16.0f, 4 / 16.0f, 1 / 16.0f};

// A tap: from a pixel of row y to the one dx, dy away, for pixels first <= x < end.
struct tap {
    int y, dx, dy, first, end;
    float kernel;
};

// False where the whole row looks beyond the picture.
static bool tap_of(const struct bd_light_filter *f, int y, int i, int j, int step, struct tap *out)
{
    const int dx = i * step, dy = j * step;
    if (y + dy < 0 || y + dy >= f->height) return false;
    *out = (struct tap){
        .y = y,
        .dx = dx,
        .dy = dy,
        .first = dx < 0 ? (-dx < f->width ? -dx : f->width) : 0,
        .end = dx > 0 ? f->width - dx : f->width,
        .kernel = b3[abs(i)] * b3[abs(j)],
    };
    return out->first < out->end;
}

static float positive(float x)
{
    return x > 0 ? x : 0;
}

// How far two places are of one surface, times the kernel.
static void weigh_surface(const struct bd_light_filter *f, const struct tap *tap,
                          float *restrict weight)
{
    const int y = tap->y, to = tap->y + tap->dy, dx = tap->dx;
    const float *nx = row_of(f, NORMAL_X, y), *ny = row_of(f, NORMAL_Y, y);
    const float *nz = row_of(f, NORMAL_Z, y), *mx = row_of(f, NORMAL_X, to) + dx;
    const float *my = row_of(f, NORMAL_Y, to) + dx, *mz = row_of(f, NORMAL_Z, to) + dx;
    const float *s = row_of(f, NEARNESS, y), *t = row_of(f, NEARNESS, to) + dx;
    const float *z = row_of(f, DEPTH, y), *d = row_of(f, DEPTH, to) + dx;
    const float *gx = row_of(f, NEARNESS_X, y), *gy = row_of(f, NEARNESS_Y, y);
    const float along_x = (float)dx, along_y = (float)tap->dy, kernel = tap->kernel;
    for (int x = tap->first; x < tap->end; x++) {
        float facing = positive(nx[x] * mx[x] + ny[x] * my[x] + nz[x] * mz[x]);
        facing *= facing;
        facing *= facing;
        facing *= facing;
        facing *= facing;
        const float expected = s[x] + gx[x] * along_x + gy[x] * along_y;
        const float depth = z[x] > d[x] ? z[x] : d[x];
        const float off = (t[x] - expected) * depth * (1 / PLANE_TOLERANCE);
        const float plane = positive(1 - off * off);
        weight[x] = kernel * facing * plane * plane;
    }
}

// --- a level ------------------------------------------------------------------------------------

// Of sigma^2, that edges may drown in there.
static float part_at(const struct bd_light_filter *f, int x, int y)
{
    const struct bd_image *parts = f->inputs.parts;
    return f->variance_part * (parts ? *bd_image_at(parts, (uint32_t)x, (uint32_t)y) : 1);
}

// Of a half's strength, smoothed along the surface.
static void measure_noise(struct bd_light_filter *f, uint32_t level, int y, float *restrict scratch)
{
    const int step = 1 << level;
    float *restrict sum = scratch, *restrict weights = sum + f->width;
    float *restrict weight = weights + f->width, *variance = row_of(f, VARIANCE, y);
    memset(sum, 0, 2 * (size_t)f->width * sizeof *sum);
    for (int j = -RADIUS; j <= RADIUS; j++)
        for (int i = -RADIUS; i <= RADIUS; i++) {
            struct tap tap;
            if (!tap_of(f, y, i, j, step, &tap)) continue;
            weigh_surface(f, &tap, weight);
            const float *a = row_of(f, LUMINANCE_A, y + tap.dy) + tap.dx;
            const float *b = row_of(f, LUMINANCE_B, y + tap.dy) + tap.dx;
            for (int x = tap.first; x < tap.end; x++) {
                const float difference = a[x] - b[x];
                sum[x] += weight[x] * (0.5f * difference * difference);
                weights[x] += weight[x];
            }
        }
    for (int x = 0; x < f->width; x++)
        variance[x] = weights[x] > 0 ? part_at(f, x, y) * sum[x] / weights[x] : 0;
}

// Adds to one half what the tap looks at, weighed by the strength of the other one.
static void add_tap(const struct bd_light_filter *f, const struct tap *tap, uint32_t level,
                    int half, const float *restrict surface, float *restrict sums)
{
    const int to = tap->y + tap->dy, other = LUMINANCE_A + 1 - half;
    const float *v = row_of(f, VARIANCE, tap->y), *u = row_of(f, VARIANCE, to) + tap->dx;
    const float *l = row_of(f, other, tap->y), *m = row_of(f, other, to) + tap->dx;
    const float *r = row_of(f, light_plane(level, half, 0), to) + tap->dx;
    const float *g = row_of(f, light_plane(level, half, 1), to) + tap->dx;
    const float *b = row_of(f, light_plane(level, half, 2), to) + tap->dx;
    float *restrict red = sums, *restrict green = red + f->width;
    float *restrict blue = green + f->width, *restrict weights = blue + f->width;
    for (int x = tap->first; x < tap->end; x++) {
        const float reach = 4 * SIGMAS * SIGMAS * (v[x] + u[x]) + 1e-30f;
        const float apart = (l[x] - m[x]) * (l[x] - m[x]);
        const float near = positive(1 - apart / reach);
        const float weight = surface[x] * near * near;
        red[x] += weight * r[x];
        green[x] += weight * g[x];
        blue[x] += weight * b[x];
        weights[x] += weight;
    }
}

// A pixel always has its own light.
static void begin_sums(const struct bd_light_filter *f, uint32_t level, int half, int y,
                       float *restrict sums)
{
    const float own = b3[0] * b3[0];
    for (int c = 0; c < 3; c++) {
        const float *light = row_of(f, light_plane(level, half, c), y);
        for (int x = 0; x < f->width; x++) sums[c * f->width + x] = own * light[x];
    }
    for (int x = 0; x < f->width; x++) sums[3 * f->width + x] = own;
}

static void end_sums(struct bd_light_filter *f, uint32_t level, int half, int y,
                     const float *restrict sums)
{
    const float *weights = sums + 3 * f->width;
    for (int c = 0; c < 3; c++) {
        float *light = row_of(f, light_plane(level + 1, half, c), y);
        for (int x = 0; x < f->width; x++) light[x] = sums[c * f->width + x] / weights[x];
    }
}

static void smooth(struct bd_light_filter *f, uint32_t level, int y, float *restrict scratch)
{
    float *weight = scratch, *sums[2] = {scratch + f->width, scratch + 5 * f->width};
    for (int half = 0; half < 2; half++) begin_sums(f, level, half, y, sums[half]);
    for (int j = -RADIUS; j <= RADIUS; j++)
        for (int i = -RADIUS; i <= RADIUS; i++) {
            struct tap tap;
            if ((i == 0 && j == 0) || !tap_of(f, y, i, j, 1 << level, &tap)) continue;
            weigh_surface(f, &tap, weight);
            for (int half = 0; half < 2; half++) add_tap(f, &tap, level, half, weight, sums[half]);
        }
    for (int half = 0; half < 2; half++) end_sums(f, level, half, y, sums[half]);
}

static void see_strength(struct bd_light_filter *f, uint32_t level, int y)
{
    for (int half = 0; half < 2; half++) {
        const float *r = row_of(f, light_plane(level, half, 0), y);
        const float *g = row_of(f, light_plane(level, half, 1), y);
        const float *b = row_of(f, light_plane(level, half, 2), y);
        float *out = row_of(f, LUMINANCE_A + half, y);
        for (int x = 0; x < f->width; x++) out[x] = strength(r[x], g[x], b[x]);
    }
}

// --- passes -------------------------------------------------------------------------------------

#define PASSES_BEFORE    2
#define PASSES_OF_LEVEL  3
#define SCRATCH_OF_WIDTH 9

uint32_t bd_light_filter_pass_count(const struct bd_light_filter *filter)
{
    return filter->is_needed ? PASSES_BEFORE + PASSES_OF_LEVEL * filter->level_count : 0;
}

static void run_level(struct bd_light_filter *f, uint32_t level, uint32_t pass, int y)
{
    if (pass == 2) {
        see_strength(f, level + 1, y);
        return;
    }
    float *scratch = malloc(SCRATCH_OF_WIDTH * (size_t)f->width * sizeof *scratch);
    BD_ASSERT(scratch);
    if (pass == 0)
        measure_noise(f, level, y, scratch);
    else
        smooth(f, level, y, scratch);
    free(scratch);
}

void bd_light_filter_row(struct bd_light_filter *filter, uint32_t pass, uint32_t y_px)
{
    const int y = (int)y_px;
    if (pass == 0)
        prepare(filter, y);
    else if (pass == 1)
        differentiate(filter, y);
    else
        run_level(filter, (pass - PASSES_BEFORE) / PASSES_OF_LEVEL,
                  (pass - PASSES_BEFORE) % PASSES_OF_LEVEL, y);
}

// What became of the halves, but for what reflects them; false where nothing was smoothed.
static bool smoothed_at(const struct bd_light_filter *f, int x, int y, float out[2][3])
{
    const bool usable = row_of(f, NORMAL_X, y)[x] != 0 || row_of(f, NORMAL_Y, y)[x] != 0 ||
                        row_of(f, NORMAL_Z, y)[x] != 0;
    for (int half = 0; usable && half < 2; half++)
        for (int c = 0; c < 3; c++)
            out[half][c] = row_of(f, light_plane(f->level_count, half, c), y)[x];
    return usable;
}

static void store_pixel(const struct bd_light_filter *f, int x, int y, float out[3])
{
    float half[2][3];
    if (!smoothed_at(f, x, y, half)) return;
    for (int c = 0; c < 3; c++)
        out[c] = 0.5f * (half[0][c] + half[1][c]) * reflectance(f, x, y, c) / f->scale;
}

static void doubt_pixel(const struct bd_light_filter *f, int x, int y, float out[4])
{
    float half[2][3];
    if (!smoothed_at(f, x, y, half)) return;
    const float *a = bd_image_at(f->inputs.half[0], (uint32_t)x, (uint32_t)y);
    const float *b = bd_image_at(f->inputs.half[1], (uint32_t)x, (uint32_t)y);
    for (int c = 0; c < 3; c++) {
        const float scale = reflectance(f, x, y, c) / f->scale;
        const float smooth_a = half[0][c] * scale, smooth_b = half[1][c] * scale;
        const float before = 0.5f * (a[c] - b[c]), left = 0.5f * (smooth_a - smooth_b);
        out[c] = left;
        out[3] += part_at(f, x, y) * (BLUR_SHARE / 3) * (before * before - left * left);
    }
}

void bd_light_filter_store(const struct bd_light_filter *filter, struct bd_image *light)
{
    if (!filter->is_needed) return;
    for (int y = 0; y < filter->height; y++)
        for (int x = 0; x < filter->width; x++)
            store_pixel(filter, x, y, bd_image_at(light, (uint32_t)x, (uint32_t)y));
}

void bd_light_filter_store_doubt(const struct bd_light_filter *filter, struct bd_image *doubt)
{
    const size_t floats = 4 * (size_t)doubt->width_px * doubt->height_px;
    memset(doubt->pixels, 0, floats * sizeof *doubt->pixels);
    if (!filter->is_needed) return;
    for (int y = 0; y < filter->height; y++)
        for (int x = 0; x < filter->width; x++)
            doubt_pixel(filter, x, y, bd_image_at(doubt, (uint32_t)x, (uint32_t)y));
}

enum bd_err bd_light_filter_run(const struct bd_light_filter_inputs *inputs, struct bd_image *light,
                                struct bd_err_detail *detail)
{
    struct bd_light_filter *filter;
    enum bd_err err = bd_light_filter_create(inputs, &filter, detail);
    if (err) return err;
    for (uint32_t pass = 0; pass < bd_light_filter_pass_count(filter); pass++)
        for (uint32_t y = 0; y < light->height_px; y++) bd_light_filter_row(filter, pass, y);
    bd_light_filter_store(filter, light);
    bd_light_filter_destroy(&filter);
    return BD_ERR_OK;
}

void bd_light_add_up(const struct bd_image *const parts[3], struct bd_image *beauty)
{
    const size_t count = (size_t)beauty->width_px * beauty->height_px;
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < 3; c++)
            beauty->pixels[4 * i + c] = parts[0]->pixels[3 * i + c] + parts[1]->pixels[3 * i + c] +
                                        parts[2]->pixels[3 * i + c];
}
