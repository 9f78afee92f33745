#include "pass/env_rays.h"

#include <math.h>

#include "base/clock.h"
#include "pass/receivers.h"

#define STEPS         12
#define HALVINGS      12
#define LOOKS         6
#define CLOSE_LOOKS   3
#define LOOKS_PRINTED 5
// Texels off the ray's start that its own surface may fill.
#define TEXELS_LEAST 2.0f
// Texels beside the ray that are taken for it.
#define TEXELS_BESIDE 1.0f
#define COSINE_LEAST  1.0f
// Of the scene's radius, nearer than which nothing is met.
#define NEAR_LEAST 1e-5f
// Cosine of a ray to a triangle that it goes along.
#define FACING_LEAST 1e-3f
// Of a triangle's sides.
#define WITHIN 1e-4f
// Of a bracket's ends, beyond which what is met may lie: a texel's place is not the ray's.
#define SLACK 0.02f
// A ray through the map's centre has no arc.
#define ARC_LEAST 1e-3f
// Printed: one less the cosine of what it may lie beside the ray.
#define EPSILON 0.001f
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_RAY 100.0

struct asked {
    const struct bd_env_maps *maps;
    const struct bd_env_map *map;
    uint32_t from_triangle;
    f3 from, along;        // relative to the map's centre; unit
    float away, near, far; // of `from`; that the ray begins and ends
};

struct found {
    float distance;
    uint32_t triangle; // BD_NO_TRIANGLE: nothing
    float u, v;
};

static f3 at(const struct asked *a, float distance)
{
    return f3_add(a->from, f3_scale(a->along, distance));
}

// How far off that place is, in distances to what the map shows there: above 1 it is behind it.
static float behind(const struct asked *a, float distance, uint32_t *texel)
{
    const f3 place = at(a, distance);
    *texel = bd_env_texel_towards(a->maps->side_px, place);
    return f3_length(place) / a->map->distances[*texel];
}

// Side of a texel, for each unit that what it shows is away.
static float texel_side(const struct asked *a)
{
    return 2 / (float)a->maps->side_px;
}

// --- what is taken ------------------------------------------------------------------------------

static void barycentrics(const struct bd_hit_triangle *t, f3 place, float *u, float *v)
{
    const f3 e1 = f3_sub(t->corner[1], t->corner[0]), e2 = f3_sub(t->corner[2], t->corner[0]);
    const f3 p = f3_sub(place, t->corner[0]), across = f3_cross(e1, e2);
    const float area2 = f3_dot(across, across);
    *u = f3_dot(f3_cross(p, e2), across) / area2;
    *v = f3_dot(f3_cross(e1, p), across) / area2;
}

static bool is_between(const struct asked *a, float distance)
{
    return distance > a->near && distance < a->far;
}

static void take(const struct asked *a, uint32_t texel, const struct bd_hit_triangle *triangle,
                 f3 place, float distance, struct found *out)
{
    float u, v;
    barycentrics(triangle, place, &u, &v);
    out->distance = distance;
    out->triangle = a->map->triangles[texel];
    out->u = f_min(f_max(u, 0), 1);
    out->v = f_min(f_max(v, 0), 1 - out->u);
}

// Where the ray goes through the triangle itself.
static bool take_triangle(const struct asked *a, uint32_t texel,
                          const struct bd_hit_triangle *triangle, struct found *out)
{
    const f3 from = f3_add(a->map->centre, a->from);
    const float along = f3_dot(triangle->normal, a->along);
    const float distance = f3_dot(triangle->normal, f3_sub(triangle->corner[0], from)) / along;
    float u, v;
    if (!is_between(a, distance)) return false;
    const f3 place = f3_add(from, f3_scale(a->along, distance));
    barycentrics(triangle, place, &u, &v);
    if (!(u > -WITHIN && v > -WITHIN && u + v < 1 + WITHIN)) return false;
    take(a, texel, triangle, place, distance, out);
    return true;
}

// What the texel shows, off the ray by so many of them at most. Flat surfaces' texels are long.
static bool take_texel(const struct asked *a, uint32_t texel,
                       const struct bd_hit_triangle *triangle, bool as_printed, struct found *out)
{
    const f3 d = f3_unit(bd_env_texel_direction(a->maps->side_px, texel));
    const float shown = a->map->distances[texel];
    const f3 way = f3_sub(f3_scale(d, shown), a->from);
    const float distance = f3_dot(way, a->along);
    const f3 beside = f3_sub(way, f3_scale(a->along, distance));
    const float cosine = f_max(f_abs(f3_dot(d, triangle->normal)), COSINE_LEAST);
    const float most = TEXELS_BESIDE * texel_side(a) * shown / cosine;
    const bool is_near = as_printed ? 1 - distance / f3_length(way) <= EPSILON
                                    : f3_dot(beside, beside) <= most * most;
    if (!is_between(a, distance) || !is_near) return false;
    take(a, texel, triangle, f3_add(a->map->centre, f3_scale(d, shown)), distance, out);
    return true;
}

// Light goes out where it went in.
static bool has_two_sides(const struct asked *a, uint32_t number,
                          const struct bd_hit_triangle *triangle)
{
    const struct bd_surface_hits *hits = &a->maps->hits;
    const int32_t material = bd_surface_hit_of(hits, number).primitive->material;
    return triangle->two_sided || hits->scene->materials[material].transmission > 0;
}

// Whose front the texel shows, but for the ray's own.
static bool triangle_at(const struct asked *a, uint32_t texel, struct bd_hit_triangle *out)
{
    const uint32_t number = a->map->triangles[texel];
    if (number == BD_NO_TRIANGLE || number == a->from_triangle ||
        !isfinite(a->map->distances[texel]) ||
        !bd_surface_hit_triangle(&a->maps->hits, number, out))
        return false;
    const float facing = f3_dot(out->normal, a->along);
    return has_two_sides(a, number, out) ? f_abs(facing) > FACING_LEAST : facing < -FACING_LEAST;
}

// --- bracketed ----------------------------------------------------------------------------------

// The one that is shown behind or before that place on the ray.
static bool meets_triangle_towards(const struct asked *a, float distance, struct found *out)
{
    struct bd_hit_triangle triangle;
    const uint32_t texel = bd_env_texel_towards(a->maps->side_px, at(a, distance));
    return triangle_at(a, texel, &triangle) && take_triangle(a, texel, &triangle, out);
}

// False position between a place before what is shown and one behind it (Illinois: an end that
// stays counts for half), until a triangle that is named on the way is met. Triangles may be
// smaller than what a few looks tell: what is shown in the end counts, if it is where the ray is.
static bool refine(const struct asked *a, float before, float g_before, float beyond,
                   float g_beyond, struct found *out)
{
    float f_before = g_before - 1, f_beyond = g_beyond - 1;
    struct asked between = *a; // what lies elsewhere on a large triangle may be hidden there
    struct bd_hit_triangle triangle;
    uint32_t texel = 0;
    int stayed = 0;
    between.near = f_max(a->near, before - SLACK * before);
    between.far = f_min(a->far, beyond + SLACK * beyond);
    if (meets_triangle_towards(&between, beyond, out) ||
        meets_triangle_towards(&between, before, out))
        return true;
    for (int i = 0; i < LOOKS; i++) {
        const float share = f_before / (f_before - f_beyond);
        const float distance = before + (beyond - before) * share;
        const float f = behind(a, distance, &texel) - 1;
        if (f < 0) {
            before = distance, f_before = f;
            if (stayed == 1) f_beyond *= 0.5f;
            stayed = 1;
        } else {
            beyond = distance, f_beyond = f;
            if (stayed == -1) f_before *= 0.5f;
            stayed = -1;
        }
        if (triangle_at(&between, texel, &triangle) &&
            take_triangle(&between, texel, &triangle, out))
            return true;
    }
    return triangle_at(&between, texel, &triangle) &&
           take_texel(&between, texel, &triangle, false, out);
}

// What stands so near to the start that no step tells it.
static bool look_close(const struct asked *a, float most, struct found *out)
{
    struct asked close = *a;
    close.far = f_min(a->far, most);
    for (int i = 0; i < CLOSE_LOOKS; i++, most *= 0.5f)
        if (meets_triangle_towards(&close, most, out)) return true;
    return false;
}

// Of one that overshoots at its first step: something may stand before that.
static bool halve(const struct asked *a, float beyond, float g_beyond, struct found *out)
{
    uint32_t texel;
    for (int i = 0; i < HALVINGS; i++) {
        const float half = 0.5f * beyond, g = behind(a, half, &texel);
        if (half < TEXELS_LEAST * texel_side(a) * a->away) return false;
        if (g < 1) return refine(a, half, g, beyond, g_beyond, out);
        beyond = half;
        g_beyond = g;
    }
    return false;
}

// Ends of the steps: equal angles of the arc, by the sine rule; the last one is where what lies
// ahead, seen from the centre, is passed, whatever is rounded: of a ray that begins at the centre
// nothing else lies between.
static void step_ends(const struct asked *a, float ends[STEPS])
{
    uint32_t texel = bd_env_texel_towards(a->maps->side_px, a->along);
    const float ahead = a->map->distances[texel];
    const float last =
        (isfinite(ahead) ? (1 + SLACK) * ahead : 4 * (float)a->maps->hits.space.radius) +
        2 * a->away;
    const f3 across = f3_cross(a->from, a->along);
    const float arc = atan2f(f3_length(across), f3_dot(a->from, a->along));
    const bool has_arc = f3_length(across) > ARC_LEAST * a->away;
    for (int k = 1; k < STEPS; k++) {
        const float angle = arc * (float)k / STEPS;
        ends[k - 1] = has_arc ? a->away * sinf(angle) / sinf(arc - angle) : last * (float)k / STEPS;
    }
    ends[STEPS - 1] = last;
}

static bool find_bracketed(const struct asked *a, struct found *out)
{
    float ends[STEPS];
    uint32_t texel;
    step_ends(a, ends);
    const float start = TEXELS_LEAST * texel_side(a) * a->away;
    float before = start, g_before = behind(a, before, &texel);
    if (look_close(a, start, out)) return true;
    for (int k = 0; k < STEPS; k++) {
        const float end = f_min(ends[k], ends[STEPS - 1]);
        if (!(end > before)) continue;
        const float g = behind(a, end, &texel);
        const bool is_first = before == start;
        if (g >= 1 && g_before < 1 && refine(a, before, g_before, end, g, out)) return true;
        if (g >= 1 && g_before >= 1 && is_first && halve(a, end, g, out)) return true;
        before = end;
        g_before = g;
    }
    return false;
}

// --- as printed ---------------------------------------------------------------------------------

static bool find_as_printed(const struct asked *a, struct found *out)
{
    uint32_t texel = bd_env_texel_towards(a->maps->side_px, a->along);
    const float ahead = a->map->distances[texel];
    float distance = ahead - f3_dot(a->from, a->along), under = 0, over = 0;
    float g_under = 0, g_over = 0;
    bool has_under = false, has_over = false;
    if (!isfinite(ahead)) return false;
    for (int i = 0; i < LOOKS_PRINTED; i++) {
        distance = f_max(distance, 0);
        const float g = behind(a, distance, &texel);
        if (g < 1)
            under = distance, g_under = g, has_under = true;
        else
            over = distance, g_over = g, has_over = true;
        distance = has_under && has_over ? over + (under - over) * (1 - g_over) / (g_under - g_over)
                                         : distance + ahead * (1 - g);
    }
    behind(a, f_max(distance, 0), &texel);
    struct bd_hit_triangle triangle;
    return triangle_at(a, texel, &triangle) && take_texel(a, texel, &triangle, true, out);
}

// --- all maps -----------------------------------------------------------------------------------

// `from_triangle` is met by nobody, nor what lies within a texel or two of the start.
static struct found nearest(const struct bd_env_view *view, f3 from, uint32_t from_triangle,
                            f3 along, float far)
{
    struct found found = {far, BD_NO_TRIANGLE, 0, 0};
    for (uint32_t i = 0; i < view->maps->count; i++) {
        struct asked a = {.maps = view->maps,
                          .map = &view->maps->maps[i],
                          .from_triangle = from_triangle,
                          .from = f3_sub(from, view->maps->maps[i].centre),
                          .along = along,
                          .far = found.distance};
        struct found own = found;
        a.away = f3_length(a.from);
        a.near = NEAR_LEAST * (float)view->maps->hits.space.radius;
        if (view->as_printed) a.near = TEXELS_LEAST * texel_side(&a) * a.away;
        if (view->as_printed ? find_as_printed(&a, &own) : find_bracketed(&a, &own)) found = own;
    }
    return found;
}

struct asking {
    const struct bd_env_view *view;
    const struct bd_ray *rays;
    struct bd_ray_hit *hits;
    const struct bd_segment *segments;
    uint32_t *occluded;
    size_t count;
};

static void ask_rays(void *user, uint32_t group)
{
    const struct asking *q = user;
    for (size_t i = (size_t)group * BD_LANES; i < (group + 1u) * BD_LANES && i < q->count; i++) {
        const struct bd_ray *ray = &q->rays[i];
        const f3 d = f3_of(ray->direction[0], ray->direction[1], ray->direction[2]);
        const float length = f3_length(d);
        q->hits[i] = (struct bd_ray_hit){.triangle = BD_NO_TRIANGLE};
        if (!(length > 0) || !isfinite(length)) continue;
        const struct found found =
            nearest(q->view, f3_of(ray->origin[0], ray->origin[1], ray->origin[2]),
                    ray->from_triangle, f3_scale(d, 1 / length), ray->far * length);
        if (found.triangle != BD_NO_TRIANGLE)
            q->hits[i] =
                (struct bd_ray_hit){found.triangle, found.u, found.v, found.distance / length};
    }
}

static bool is_blocked(const struct bd_env_view *view, const struct bd_segment *segment)
{
    const f3 from = f3_of(segment->from[0], segment->from[1], segment->from[2]);
    const f3 way = f3_sub(f3_of(segment->to[0], segment->to[1], segment->to[2]), from);
    const float length = f3_length(way);
    if (!(length > 0) || !isfinite(length)) return false;
    const float beside = 1 - TEXELS_LEAST * 2 / (float)view->maps->side_px;
    const struct found found =
        nearest(view, from, segment->from_triangle, f3_scale(way, 1 / length), beside * length);
    return found.triangle != BD_NO_TRIANGLE && found.triangle != segment->to_triangle;
}

// A group is a word of bits.
static void ask_segments(void *user, uint32_t group)
{
    const struct asking *q = user;
    uint32_t bits = 0;
    for (uint32_t i = 0; i < 32 && (size_t)group * 32 + i < q->count; i++)
        bits |= (uint32_t)is_blocked(q->view, &q->segments[(size_t)group * 32 + i]) << i;
    q->occluded[group] = bits;
}

static enum bd_err ask(const struct bd_pass_context *context, struct bd_pool *pool,
                       struct asking *asking, uint32_t group_size,
                       void (*work)(void *user, uint32_t group), struct bd_ray_counts *traced)
{
    const struct bd_processor processor = {pool, NULL};
    struct bd_pass_context own = *context;
    own.processor = &processor;
    const uint64_t start_ns = bd_clock_ns();
    bd_slicer_work(context->slicer, "environment rays");
    const uint32_t groups = (uint32_t)((asking->count + group_size - 1) / group_size);
    const enum bd_err err = bd_receivers_each(
        &own, groups, UNITS_PER_RAY * group_size * asking->view->maps->count, work, asking);
    traced->count += asking->count;
    traced->ms += bd_ms_since(start_ns);
    return err;
}

enum bd_err bd_env_rays_nearest(const struct bd_pass_context *context,
                                const struct bd_env_view *view, struct bd_pool *pool,
                                const struct bd_ray *rays, size_t count, struct bd_ray_hit *hits,
                                struct bd_ray_counts *traced)
{
    struct asking asking = {.view = view, .rays = rays, .hits = hits, .count = count};
    return ask(context, pool, &asking, BD_LANES, ask_rays, traced);
}

enum bd_err bd_env_rays_occluded(const struct bd_pass_context *context,
                                 const struct bd_env_view *view, struct bd_pool *pool,
                                 const struct bd_segment *segments, size_t count,
                                 uint32_t *occluded, struct bd_ray_counts *traced)
{
    struct asking asking = {
        .view = view, .segments = segments, .occluded = occluded, .count = count};
    return ask(context, pool, &asking, 32, ask_segments, traced);
}
