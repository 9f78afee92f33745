#include "both.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/vec.h"
#include "rays/cutout.h"
#include "rays/structure.h"

// --- one of each --------------------------------------------------------------------------------

void both_open(struct both *both)
{
    const char *device = getenv("BOUNCED_TEST_DEVICE");
    const struct bd_gpu_options options = {.device = device ? device : "auto", .debug = true};
    struct bd_err_detail detail = {0};
    *both = (struct both){.chances = 88172645463325252u};
    if (bd_gpu_create(&options, &both->context.gpu, &detail)) {
        fprintf(stderr, "skipped: %s\n", detail.message);
        exit(77);
    }
    bd_slicer_init(&both->slicer, both->context.gpu, NULL, NULL);
    both->context.slicer = &both->slicer;
    both->pool = bd_pool_create(0);
}

void both_close(struct both *both)
{
    both_drop(both);
    bd_pool_destroy(&both->pool);
    bd_gpu_destroy(&both->context.gpu);
}

enum bd_err both_take(struct both *both, struct bd_scene *scene, struct bd_err_detail *detail)
{
    const struct bd_rays_build build = {.repeated_max = BD_RAYS_REPEATED_MAX};
    struct bd_rays *rays = NULL;
    uint64_t start_ns = bd_clock_ns();
    enum bd_err err = bd_ray_nodes_create(scene, &build, UINT64_MAX, &both->nodes, detail);
    if (!err)
        err = bd_occluders_upload(&both->context, both->nodes, &both->occluders[DEVICE], detail);
    both->built_ms[DEVICE] = bd_ms_since(start_ns);
    start_ns = bd_clock_ns();
    if (!err) err = bd_rays_create(scene, &build, &rays, detail);
    both->built_ms[PROCESSOR] = bd_ms_since(start_ns);
    if (!err) both->occluders[PROCESSOR] = bd_occluders_of_rays(&rays);
    if (err) both_drop(both);
    return err;
}

void both_drop(struct both *both)
{
    for (int e = 0; e < EXECUTOR_COUNT; e++)
        bd_occluders_destroy(both->context.gpu, &both->occluders[e]);
    bd_ray_nodes_destroy(&both->nodes);
}

static void must(enum bd_err err, const struct bd_err_detail *detail)
{
    if (!err) return;
    fprintf(stderr, "rays: %s\n", detail->message);
    abort();
}

struct bd_ray_counts both_ask(struct both *both, enum executor executor, enum bd_rays_alpha alpha,
                              const struct bd_segment *segments, size_t count, uint32_t *bits)
{
    const size_t most = BD_SEGMENTS_BYTES_MAX / sizeof *segments;
    const struct bd_visibility_inputs inputs = {
        .occluders = both->occluders[executor], .pool = both->pool, .alpha = alpha};
    struct bd_gpu *gpu = both->context.gpu;
    struct bd_segments *slice;
    struct bd_err_detail detail = {0};
    must(bd_segments_create(gpu, count < most ? count : most, &slice, &detail), &detail);
    for (size_t at = 0, part; at < count; at += part) {
        part = count - at < most ? count - at : most;
        bd_buf_upload(gpu, slice->segments, 0, segments + at, part * sizeof *segments);
        must(bd_visibility_run(&both->context, &inputs, slice, part, &detail), &detail);
        must(bd_buf_read(gpu, slice->occluded, 0, bits + at / 32, (part + 31) / 32 * 4), &detail);
    }
    const struct bd_ray_counts traced = slice->traced;
    bd_segments_destroy(gpu, &slice);
    return traced;
}

struct bd_ray_counts both_meet(struct both *both, enum executor executor, enum bd_rays_alpha alpha,
                               const struct bd_ray *rays, size_t count, struct bd_ray_hit *hits)
{
    const struct bd_visibility_inputs inputs = {
        .occluders = both->occluders[executor], .pool = both->pool, .alpha = alpha};
    struct bd_ray_counts traced = {0};
    struct bd_err_detail detail = {0};
    must(bd_nearest_ask(&both->context, &inputs, rays, count, hits, &traced, &detail), &detail);
    return traced;
}

// --- segments and rays ---------------------------------------------------------------------------

double both_chance(struct both *both)
{
    uint64_t *state = &both->chances;
    *state ^= *state << 13, *state ^= *state >> 7, *state ^= *state << 17;
    return (double)(*state >> 11) * 0x1p-53;
}

static uint32_t point_of_triangle(struct both *both, float at[3])
{
    const uint32_t t = (uint32_t)(both_chance(both) * both->nodes->triangle_count);
    const struct bd_ray_triangle *triangle = &both->nodes->triangles[t];
    double u = both_chance(both), v = both_chance(both);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    for (int c = 0; c < 3; c++)
        at[c] = (float)((1 - u - v) * triangle->a[c] + u * triangle->b[c] + v * triangle->c[c]);
    return triangle->number;
}

static void point_of_box(struct both *both, float at[3])
{
    const struct bd_ray_node *root = &both->nodes->nodes[0];
    for (int c = 0; c < 3; c++)
        at[c] =
            (float)(root->least[c] + both_chance(both) * ((double)root->most[c] - root->least[c]));
}

void both_choose(struct both *both, struct bd_segment *segments, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct bd_segment *s = &segments[i];
        s->from_triangle = s->to_triangle = BD_NO_TRIANGLE;
        if (i % 3 == 0) {
            s->from_triangle = point_of_triangle(both, s->from);
            s->to_triangle = point_of_triangle(both, s->to);
            continue;
        }
        float other[3];
        point_of_box(both, s->from);
        point_of_box(both, other);
        const int axis = (int)(3 * both_chance(both));
        for (int c = 0; c < 3; c++) s->to[c] = i % 3 == 1 || c == axis ? other[c] : s->from[c];
    }
}

void both_choose_rays(struct both *both, struct bd_ray *rays, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct bd_segment s[3]; // of each kind
        both_choose(both, s, 3);
        const struct bd_segment *along = &s[i % 3];
        rays[i] = (struct bd_ray){.from_triangle = along->from_triangle,
                                  .far = i % 2 ? INFINITY : 0.9f,
                                  .near = i / 3 % 3 ? 0 : 0.1f};
        const float *to = along->from_triangle == BD_NO_TRIANGLE ? along->to : s[1].to;
        memcpy(rays[i].origin, along->from, sizeof along->from);
        for (int c = 0; c < 3; c++) rays[i].direction[c] = to[c] - along->from[c];
    }
}

// --- the exact answer ---------------------------------------------------------------------------

// Of a segment's ends, in units of 2^-24 of their largest coordinate: what rounding may do to a
// position, its difference from another and the products of those.
#define ROUNDING 8.0
#define TRIALS   64
// Of an alpha, by texture coordinates of some units.
#define ALPHA_ROUNDING 1e-5

struct exact {
    bd_dvec3 from, along;
    double near, far;
};

static double largest(const float v[3])
{
    return fmax(fabs((double)v[0]), fmax(fabs((double)v[1]), fabs((double)v[2])));
}

static bd_dvec3 wide(const float v[3])
{
    return (bd_dvec3){v[0], v[1], v[2]};
}

static bd_dvec3 shift(struct both *both, const float v[3], double by)
{
    return (bd_dvec3){v[0] + by * (2 * both_chance(both) - 1),
                      v[1] + by * (2 * both_chance(both) - 1),
                      v[2] + by * (2 * both_chance(both) - 1)};
}

static struct exact shifted(struct both *both, const struct bd_segment *s, double units)
{
    const double size = fmax(largest(s->from), largest(s->to));
    struct exact e = {.from = shift(both, s->from, units * 0x1p-24 * size)};
    e.along = bd_dvec3_sub(shift(both, s->to, units * 0x1p-24 * size), e.from);
    e.near = (double)BD_RAY_BIAS * size / sqrt(bd_dvec3_dot(e.along, e.along));
    e.near *= 1 + units * 0x1p-24 * (2 * both_chance(both) - 1);
    e.far = 1 - e.near + units * 0x1p-24 * (2 * both_chance(both) - 1);
    return e;
}

// As BD_RAYS_ALPHA_MASK has it.
static bool is_there(struct both *both, const struct bd_ray_triangle *t, double u, double v)
{
    if (!t->cutout) return true;
    const struct bd_rays *rays = both->occluders[PROCESSOR]->rays;
    uint32_t triangle;
    const struct bd_primitive *primitive = bd_rays_primitive(rays, t->number, &triangle);
    const struct bd_material *material = &rays->scene->materials[primitive->material];
    const double alpha = bd_cutout_alpha(rays->scene, primitive, triangle, (float)u, (float)v);
    return alpha + ALPHA_ROUNDING * (2 * both_chance(both) - 1) >=
           (material->alpha_mode == BD_ALPHA_MASK ? material->alpha_cutoff : 0.5f);
}

// Moeller and Trumbore. `facing`: which side of the triangle it comes from.
static bool meets(struct both *both, const struct exact *e, const struct bd_ray_triangle *t,
                  bool *facing)
{
    const bd_dvec3 a = wide(t->a), e1 = bd_dvec3_sub(wide(t->b), a),
                   e2 = bd_dvec3_sub(wide(t->c), a);
    const bd_dvec3 p = bd_dvec3_cross(e->along, e2), s = bd_dvec3_sub(e->from, a);
    const double determinant = bd_dvec3_dot(e1, p);
    *facing = determinant > 0;
    if (determinant == 0) return false;
    const bd_dvec3 q = bd_dvec3_cross(s, e1);
    const double u = bd_dvec3_dot(s, p) / determinant;
    const double v = bd_dvec3_dot(e->along, q) / determinant;
    const double at = bd_dvec3_dot(e2, q) / determinant;
    return u >= 0 && v >= 0 && u + v <= 1 && at >= e->near && at <= e->far &&
           is_there(both, t, u, v);
}

static double extent(const struct bd_ray_triangle *t)
{
    double most = 0;
    for (int c = 0; c < 3; c++)
        most = fmax(most,
                    fmax(t->a[c], fmax(t->b[c], t->c[c])) - fmin(t->a[c], fmin(t->b[c], t->c[c])));
    return most;
}

// Whether the segment comes as near the triangle's box.
static bool is_beside(const struct bd_segment *s, const struct bd_ray_triangle *t, double margin)
{
    double enter = 0, leave = 1;
    for (int c = 0; c < 3; c++) {
        const double least = fmin(t->a[c], fmin(t->b[c], t->c[c])) - margin - s->from[c];
        const double most = fmax(t->a[c], fmax(t->b[c], t->c[c])) + margin - s->from[c];
        const double along = (double)s->to[c] - s->from[c];
        if (along == 0 && (least > 0 || most < 0)) return false;
        if (along == 0) continue;
        enter = fmax(enter, fmin(least / along, most / along));
        leave = fmin(leave, fmax(least / along, most / along));
    }
    return enter <= leave;
}

// Products of three of its lengths are no normal numbers.
static bool is_too_small(const struct bd_segment *s)
{
    return pow(fmax(largest(s->from), largest(s->to)), 3) < (double)FLT_MIN * 0x1p24;
}

bool both_is_close(struct both *both, const struct bd_segment *s)
{
    if (is_too_small(s)) return true;
    const double rounding = ROUNDING * 0x1p-24 * fmax(largest(s->from), largest(s->to));
    const struct bd_ray_nodes *nodes = both->nodes;
    bool is_close = false, is_sure = false;
    const struct bd_ray_triangle **beside = malloc((nodes->triangle_count + 1) * sizeof *beside);
    size_t count = 0;
    for (uint32_t t = 0; t < nodes->triangle_count; t++) {
        const struct bd_ray_triangle *triangle = &nodes->triangles[t];
        if (triangle->number == s->from_triangle || triangle->number == s->to_triangle) continue;
        // In its plane rounding may even meet it beside itself, where its leaf is looked at.
        if (!is_beside(s, triangle, extent(triangle) + 16 * rounding)) continue;
        beside[count++] = triangle;
        // So small that no trial need meet it.
        is_close |= extent(triangle) < 4 * rounding && is_beside(s, triangle, rounding);
    }
    uint32_t *met = calloc(count + 1, sizeof *met), *faced = calloc(count + 1, sizeof *faced);
    for (int trial = 0; trial < TRIALS; trial++) {
        const struct exact e = shifted(both, s, ROUNDING);
        for (size_t t = 0; t < count; t++) {
            bool facing;
            met[t] += meets(both, &e, beside[t], &facing);
            faced[t] += facing;
        }
    }
    for (size_t t = 0; t < count; t++) {
        is_close |= met[t] % TRIALS > 0 || faced[t] % TRIALS > 0;
        is_sure |= met[t] == TRIALS;
    }
    free(beside);
    free(met);
    free(faced);
    return is_close && !is_sure;
}

struct differences both_compare(struct both *both, const struct bd_segment *segments, size_t count,
                                const uint32_t *a, const uint32_t *b)
{
    struct differences d = {0};
    for (size_t i = 0; i < count; i++) {
        if (((a[i / 32] ^ b[i / 32]) >> i % 32 & 1) == 0) continue;
        d.count++;
        if (both_is_close(both, &segments[i])) continue;
        if (d.unexplained++ == 0) d.first_unexplained = i;
    }
    return d;
}

// From where the ray begins to a little behind the distance.
static struct bd_segment segment_to(const struct bd_ray *ray, float distance)
{
    struct bd_segment s = {.from_triangle = ray->from_triangle, .to_triangle = BD_NO_TRIANGLE};
    for (int c = 0; c < 3; c++) {
        s.from[c] = ray->origin[c] + ray->near * ray->direction[c];
        s.to[c] = ray->origin[c] + 1.0001f * distance * ray->direction[c];
    }
    return s;
}

static bool is_explained(struct both *both, const struct bd_ray *ray, const struct bd_ray_hit *a,
                         const struct bd_ray_hit *b)
{
    const bool both_met = a->triangle != BD_NO_TRIANGLE && b->triangle != BD_NO_TRIANGLE;
    const float apart = fabsf(a->distance - b->distance);
    const float *d = ray->direction;
    const double length = sqrt(bd_dvec3_dot(wide(d), wide(d)));
    const double rounding = (double)BD_RAY_BIAS * largest(ray->origin) / length;
    // In a plane that is nearly its own, a ray meets it wherever rounding says.
    const double share = a->triangle == b->triangle ? 1e-3 : 1e-5;
    if (both_met && apart <= rounding + share * fmax(a->distance, b->distance)) return true;
    const bool a_is_nearer = a->triangle != BD_NO_TRIANGLE &&
                             (b->triangle == BD_NO_TRIANGLE || a->distance < b->distance);
    const struct bd_segment s = segment_to(ray, a_is_nearer ? a->distance : b->distance);
    return both_is_close(both, &s);
}

struct differences both_compare_hits(struct both *both, const struct bd_ray *rays, size_t count,
                                     const struct bd_ray_hit *a, const struct bd_ray_hit *b)
{
    struct differences d = {0};
    for (size_t i = 0; i < count; i++) {
        const bool same = a[i].triangle == b[i].triangle;
        if (same && a[i].triangle == BD_NO_TRIANGLE) continue;
        d.count += !same;
        if (is_explained(both, &rays[i], &a[i], &b[i])) continue;
        if (d.unexplained++ == 0) d.first_unexplained = i;
    }
    return d;
}
