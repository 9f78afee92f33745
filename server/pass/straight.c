#include "pass/straight.h"

#include <math.h>

#include "pass/nearest.h"
#include "pass/receivers.h"

// Of the slicer, one for each evaluation of a VPL: of 32 segments.
#define UNITS_PER_WORD 1000.0
#define UNITS_PER_RAYS 500.0

// --- one way ------------------------------------------------------------------------------------

struct way {
    f3 passed;
    struct bd_solids solids;
    float gone; // of its length
    struct bd_ray_hit hit;
};

// What glass that was met lets pass; there `place` is set, and the way is behind it.
static f3 passes_glass(const struct bd_visibility_inputs *v, struct way *way, f3 d, f3 *place)
{
    const struct bd_ray_hit *hit = &way->hit;
    struct bd_interface at;
    if (!v->panes || !bd_interface_at(v->panes, hit->triangle, hit->u, hit->v, d, &at))
        return f3_of(0, 0, 0);
    const struct bd_solid_edge edge = bd_solid_edge_at(v->panes, &way->solids, &at);
    const f3 extinction = at.entering ? edge.outside : edge.inside;
    at.ior = edge.ior;
    *place = at.position;
    const f3 passes = edge.is_none ? f3_of(1, 1, 1) : bd_interface_straight(&at, v->straight, d);
    if (at.thin) return passes;
    bd_solids_cross(v->panes, &way->solids, &at);
    return bd_interface_absorbed(passes, extinction, hit->distance);
}

// Through the wall that it met, if that lets it: `ray` begins there then.
static bool pass(const struct bd_visibility_inputs *v, bool veils, struct bd_ray *ray,
                 struct way *way)
{
    const f3 from = f3_of(ray->origin[0], ray->origin[1], ray->origin[2]);
    const f3 d = f3_of(ray->direction[0], ray->direction[1], ray->direction[2]);
    const struct bd_ray_hit *hit = &way->hit;
    const float beside = veils ? 1 - bd_rays_opacity(v->occluders->rays, hit) : 0;
    f3 place = f3_add(from, f3_scale(d, hit->distance));
    const f3 glass = f3_scale(passes_glass(v, way, d, &place), 1 - beside);
    const f3 passes = f3_add(glass, f3_of(beside, beside, beside));
    if (!(passes.x > 0 || passes.y > 0 || passes.z > 0)) return false;
    way->passed = f3_mul(way->passed, passes);
    way->gone += hit->distance;
    ray->far -= hit->distance;
    ray->origin[0] = place.x;
    ray->origin[1] = place.y;
    ray->origin[2] = place.z;
    ray->from_triangle = hit->triangle;
    return ray->far > 0;
}

// On to `to_triangle` or what does not let it pass, or nothing. With `veils` they let it pass in
// part, else they are there or not.
static void go_on(const struct bd_visibility_inputs *v, bool veils, struct bd_ray ray,
                  uint32_t to_triangle, struct way *way)
{
    const enum bd_rays_alpha alpha = veils ? BD_RAYS_ALPHA_ANY : v->alpha;
    for (uint32_t walls = 0; walls < BD_STRAIGHT_WALLS_MAX; walls++) {
        const uint32_t met = way->hit.triangle;
        if (met == BD_NO_TRIANGLE || met == to_triangle || !pass(v, veils, &ray, way)) break;
        bd_rays_nearest(v->occluders->rays, NULL, alpha, &ray, 1, &way->hit);
    }
    way->hit.distance += way->gone;
}

static float largest(const float v[3])
{
    return fmaxf(fabsf(v[0]), fmaxf(fabsf(v[1]), fabsf(v[2])));
}

f3 bd_straight_along(const struct bd_visibility_inputs *v, const struct bd_segment *segment)
{
    const float *from = segment->from, *to = segment->to;
    const f3 along = f3_of(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    const float length = f3_length(along), bias = BD_RAY_BIAS * fmaxf(largest(from), largest(to));
    const f3 d = f3_scale(along, 1 / length);
    const struct bd_ray ray = {.origin = {from[0], from[1], from[2]},
                               .from_triangle = segment->from_triangle,
                               .direction = {d.x, d.y, d.z},
                               .far = length - bias};
    struct way way = {.passed = {1, 1, 1}};
    bd_rays_nearest(v->occluders->rays, NULL, bd_visibility_alpha_of_lights(v), &ray, 1, &way.hit);
    go_on(v, v->veils, ray, segment->to_triangle, &way);
    const bool arrives =
        way.hit.triangle == BD_NO_TRIANGLE || way.hit.triangle == segment->to_triangle;
    return arrives ? way.passed : f3_of(0, 0, 0);
}

// --- many segments ------------------------------------------------------------------------------

struct asked {
    const struct bd_visibility_inputs *visibility;
    const struct bd_segment *segments;
    size_t count;
    uint32_t *occluded;
    f3 *brought;
    uint32_t parts;
};

static void pass_segment(const struct asked *a, size_t i)
{
    const f3 passed = bd_straight_along(a->visibility, &a->segments[i]);
    if (!(passed.x > 0 || passed.y > 0 || passed.z > 0)) return;
    for (size_t p = i * a->parts; p < (i + 1) * a->parts; p++)
        a->brought[p] = f3_mul(a->brought[p], passed);
    a->occluded[i / 32] &= ~(1u << i % 32);
}

// A word of bits is one thread's.
static void pass_word(void *user, uint32_t word)
{
    const struct asked *a = user;
    const size_t first = 32 * (size_t)word;
    for (size_t i = first; i < first + 32 && i < a->count; i++)
        if (a->occluded[word] >> i % 32 & 1) pass_segment(a, i);
}

enum bd_err bd_straight_ask(const struct bd_pass_context *context,
                            const struct bd_visibility_inputs *visibility,
                            const struct bd_segment *segments, size_t count, uint32_t *occluded,
                            f3 *brought, uint32_t parts, struct bd_ray_counts *traced,
                            struct bd_err_detail *detail)
{
    struct bd_visibility_inputs first = *visibility;
    first.alpha = bd_visibility_alpha_of_lights(visibility);
    enum bd_err err = bd_visibility_ask(context, &first, segments, count, occluded, traced, detail);
    if (err || !bd_visibility_looks_through(visibility)) return err;
    struct asked a = {visibility, segments, count, occluded, brought, parts};
    bd_slicer_work(context->slicer, "straight");
    return bd_receivers_each(context, (uint32_t)((count + 31) / 32), UNITS_PER_WORD, pass_word, &a);
}

// --- by chance ----------------------------------------------------------------------------------

static bool is_passed(const struct bd_visibility_inputs *v, const struct bd_segment *s)
{
    const f3 passed = bd_straight_along(v, s);
    const float mean = (passed.x + passed.y + passed.z) / 3;
    return mean > 0 && bd_rays_chance(s->from, s->to, s->to_triangle) < mean;
}

static void draw_word(void *user, uint32_t word)
{
    const struct asked *a = user;
    const size_t first = 32 * (size_t)word;
    for (size_t i = first; i < first + 32 && i < a->count; i++)
        if (a->occluded[word] >> i % 32 & 1 && is_passed(a->visibility, &a->segments[i]))
            a->occluded[word] &= ~(1u << i % 32);
}

void bd_straight_by_chance(const struct bd_visibility_inputs *visibility,
                           const struct bd_segment *segments, size_t count, uint32_t *occluded)
{
    struct asked a = {visibility, segments, count, occluded, NULL, 0};
    if (bd_pool_run(visibility->pool, (uint32_t)((count + 31) / 32), draw_word, NULL, &a))
        return; // nobody stops it
}

// --- many rays ----------------------------------------------------------------------------------

struct followed {
    const struct bd_visibility_inputs *visibility;
    const struct bd_ray *rays;
    size_t count;
    struct bd_ray_hit *hits;
    f3 *passed;
};

static void follow_group(void *user, uint32_t group)
{
    const struct followed *f = user;
    for (size_t i = (size_t)group * BD_LANES; i < (group + 1) * (size_t)BD_LANES && i < f->count;
         i++) {
        struct way way = {.passed = {1, 1, 1}, .hit = f->hits[i]};
        go_on(f->visibility, false, f->rays[i], BD_NO_TRIANGLE, &way);
        f->hits[i] = way.hit;
        f->passed[i] = way.passed;
    }
}

enum bd_err bd_straight_nearest(const struct bd_pass_context *context,
                                const struct bd_visibility_inputs *visibility,
                                const struct bd_ray *rays, size_t count, struct bd_ray_hit *hits,
                                f3 *passed, struct bd_ray_counts *traced,
                                struct bd_err_detail *detail)
{
    enum bd_err err = bd_nearest_ask(context, visibility, rays, count, hits, traced, detail);
    for (size_t i = 0; !err && i < count; i++) passed[i] = f3_of(1, 1, 1);
    if (err || !visibility->panes) return err;
    struct followed f = {visibility, rays, count, hits, passed};
    bd_slicer_work(context->slicer, "straight");
    return bd_receivers_each(context, (uint32_t)((count + BD_LANES - 1) / BD_LANES), UNITS_PER_RAYS,
                             follow_group, &f);
}
