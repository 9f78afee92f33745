#include "pass/near_lamps.h"

#include <math.h>
#include <stdlib.h>

#include "kernel/lift.h"
#include "kernel/light.h"
#include "kernel/projected_point.h"
#include "lights/sequence.h"
#include "lights/surface_hits.h"
#include "pass/choose.h"
#include "pass/f3_arrays.h"
#include "pass/nearest.h"
#include "pass/punctual_photons.h"

// In distances between points: a lamp that close to one is near; so far reaches what lands; and so
// far about where it does it is spread, over so many points at most, or one had all of the light
// and few would look at it.
#define NEAR       2.0f
#define NEAR_REACH 4.0f
#define SPREAD     3.0f
#define POINTS_MOST 64u
// Points about a lamp that may be lit, at most.
#define ABOUT_MOST 1024u
// Of a lamp, powers of two; of all that are on their way at once.
#define RAYS_MOST    1024u
#define RAYS_LEAST   16u
#define RAYS_AT_ONCE 65536u
#define LAMPS_PER_PAUSE 256u
// Numbers that nobody else of a frame draws by its seed.
#define OF_NEAR_LAMPS 0x6e656172u

struct landing {
    const struct bd_pass_context *context;
    const struct bd_near_lamps_inputs *inputs;
    struct bd_near_lamps *out;
    struct bd_surface_hits surfaces;
    struct bd_sequence sequence;
    uint32_t *lamps; // those that are near
    uint32_t lamp_count, rays_each;
    struct bd_ray *rays;
    struct bd_ray_hit *hits;
    float distance; // between points
    // Of each point the last lamp that sees it, from 1 on; and what that is asked by.
    uint32_t *seen_by, *about, *hidden;
    struct bd_segment *segments;
    struct bd_ray_counts *traced;
    struct bd_err_detail *detail;
};

static enum bd_err no_memory(const struct landing *l)
{
    return bd_err_set(l->detail, BD_ERR_NO_MEMORY, "points", "no memory for %u lamps near surfaces",
                      l->inputs->count);
}

static bool is_near(const struct landing *l, const struct bd_light_uniform *lamp)
{
    if (lamp->kind == BD_LIGHT_KIND_DIRECTIONAL) return false;
    return bd_point_clusters_near(l->inputs->points, f3_from(&lamp->position), f3_of(0, 0, 0),
                                  NEAR * l->distance) != BD_NO_POINT_NEAR;
}

static enum bd_err list_lamps(struct landing *l)
{
    const struct bd_near_lamps_inputs *in = l->inputs;
    l->lamps = malloc((in->count + 1) * sizeof *l->lamps);
    if (!l->lamps) return no_memory(l);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < in->count; i++) {
        if (is_near(l, &in->punctuals[i])) l->lamps[l->lamp_count++] = i;
        if (i % LAMPS_PER_PAUSE == 0) err = bd_slicer_pause(l->context->slicer);
    }
    for (l->rays_each = RAYS_MOST; l->rays_each > RAYS_LEAST; l->rays_each /= 2)
        if (l->rays_each * l->lamp_count <= RAYS_AT_ONCE) break;
    return err;
}

static enum bd_err make_room(struct landing *l)
{
    const uint32_t points = l->inputs->points->count;
    l->rays = malloc(RAYS_AT_ONCE * sizeof *l->rays);
    l->hits = malloc(RAYS_AT_ONCE * sizeof *l->hits);
    l->out->reach2 = calloc(l->inputs->count + 1, sizeof *l->out->reach2);
    l->out->irradiance = calloc(2 * (size_t)points + 1, sizeof *l->out->irradiance);
    l->seen_by = calloc((size_t)points + 1, sizeof *l->seen_by);
    l->about = malloc(ABOUT_MOST * sizeof *l->about);
    l->segments = malloc(ABOUT_MOST * sizeof *l->segments);
    l->hidden = malloc(ABOUT_MOST / 32 * sizeof *l->hidden);
    const bool has_room = l->rays && l->hits && l->out->reach2 && l->out->irradiance &&
                          l->seen_by && l->about && l->segments && l->hidden;
    return has_room ? BD_ERR_OK : no_memory(l);
}

static const struct bd_light_uniform *lamp_at(const struct landing *l, uint32_t k)
{
    return &l->inputs->punctuals[l->lamps[k]];
}

static void send(const struct landing *l, uint32_t first, uint32_t count)
{
    for (uint32_t i = 0; i < count * l->rays_each; i++) {
        const uint32_t k = first + i / l->rays_each;
        float number[2];
        bd_sequence_pair(&l->sequence, k * l->rays_each + i % l->rays_each, number);
        l->rays[i] = bd_punctual_ray(lamp_at(l, k), number);
    }
}

static bool lands(const struct landing *l, const struct bd_ray_hit *hit)
{
    return hit->triangle != BD_NO_TRIANGLE && hit->distance < NEAR_REACH * l->distance;
}

static bool meets_glass(const struct landing *l, uint32_t first_ray)
{
    const struct bd_scene *scene = l->inputs->snapshot;
    for (uint32_t i = first_ray; l->inputs->glass && i < first_ray + l->rays_each; i++) {
        if (!lands(l, &l->hits[i])) continue;
        const struct bd_surface_hit hit = bd_surface_hit_of(&l->surfaces, l->hits[i].triangle);
        if (scene->materials[hit.primitive->material].transmission > 0) return true;
    }
    return false;
}

static struct bd_segment segment_to(const struct landing *l, f3 lamp, uint32_t point)
{
    const struct bd_projected_point *at = &l->inputs->points->points[point];
    const f3 position = f3_of(at->x, at->y, at->z), normal = normal_of_bits(at->normal);
    const float lift = lift_of_segment(0, lamp, position);
    const float up = f3_dot(f3_sub(lamp, position), normal) < 0 ? -lift : lift;
    struct bd_segment segment = {.from_triangle = BD_NO_TRIANGLE, .to_triangle = BD_NO_TRIANGLE};
    f3_store(segment.from, lamp);
    f3_store(segment.to, f3_add(position, f3_scale(normal, up)));
    return segment;
}

// Which points see it: light that lands beside a thin wall is none of those behind it.
static enum bd_err look_about(struct landing *l, uint32_t k)
{
    const f3 lamp = f3_from(&lamp_at(l, k)->position);
    const float reach = (NEAR_REACH + SPREAD) * l->distance;
    const uint32_t count = bd_point_clusters_within(l->inputs->points, lamp, f3_of(0, 0, 0), reach,
                                                    l->about, ABOUT_MOST);
    for (uint32_t i = 0; i < count; i++) l->segments[i] = segment_to(l, lamp, l->about[i] / 2);
    const enum bd_err err = bd_visibility_ask(l->context, l->inputs->visibility, l->segments, count,
                                              l->hidden, l->traced, l->detail);
    for (uint32_t i = 0; !err && i < count; i++)
        if (!(l->hidden[i / 32] >> i % 32 & 1)) l->seen_by[l->about[i] / 2] = k + 1;
    return err;
}

static uint32_t keep_seen(const struct landing *l, uint32_t k, uint32_t *sides, uint32_t count)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < count; i++)
        if (l->seen_by[sides[i] / 2] == k + 1) sides[kept++] = sides[i];
    return kept;
}

// All points about get as much. If the nearest got it, points with much of a surface to themselves
// would get more, and rays that end on that would bring it once more as often.
static void land(struct landing *l, uint32_t k, uint32_t ray, f3 flux)
{
    const struct bd_point_clusters *points = l->inputs->points;
    const struct bd_ray_hit *hit = &l->hits[ray];
    const struct bd_ray *from = &l->rays[ray];
    const f3 way = f3_of(from->direction[0], from->direction[1], from->direction[2]);
    struct bd_surface_point at;
    uint32_t sides[POINTS_MOST];
    if (!lands(l, hit) || !bd_surface_hit_at(&l->surfaces, hit->triangle, hit->u, hit->v, way, &at))
        return;
    uint32_t count = bd_point_clusters_within(points, at.position, at.normal, SPREAD * l->distance,
                                              sides, POINTS_MOST);
    count = keep_seen(l, k, sides, count);
    if (count == 0) {
        const float reach = (NEAR_REACH + SPREAD) * l->distance;
        count = bd_point_clusters_nearest(points, at.position, at.normal, reach, sides,
                                          BD_NEAREST_MOST);
        count = keep_seen(l, k, sides, count);
    }
    for (uint32_t i = 0; i < count; i++) {
        f3 *to = &l->out->irradiance[sides[i]];
        *to = f3_add(*to, f3_scale(flux, 1 / (points->area * (float)count)));
    }
}

static void land_all_of(struct landing *l, uint32_t k, uint32_t first_ray)
{
    const struct bd_light_uniform *lamp = lamp_at(l, k);
    const f3 flux = f3_scale(bd_punctual_flux(lamp), 1 / (float)l->rays_each);
    const float reach = NEAR_REACH * l->distance;
    if (meets_glass(l, first_ray)) return;
    l->out->reach2[l->lamps[k]] = reach * reach;
    for (uint32_t i = first_ray; i < first_ray + l->rays_each; i++)
        land(l, k, i, f3_scale(flux, window_of_range(l->hits[i].distance, lamp->inverse_range)));
}

static enum bd_err light_all(struct landing *l)
{
    const uint32_t most = RAYS_AT_ONCE / l->rays_each;
    enum bd_err err = make_room(l);
    for (uint32_t first = 0, count; !err && first < l->lamp_count; first += count) {
        count = l->lamp_count - first < most ? l->lamp_count - first : most;
        send(l, first, count);
        err = bd_nearest_ask(l->context, l->inputs->visibility, l->rays,
                             (size_t)count * l->rays_each, l->hits, l->traced, l->detail);
        bd_slicer_work(l->context->slicer, "near lamps");
        for (uint32_t k = 0; !err && k < count; k++) {
            err = look_about(l, first + k);
            if (!err) land_all_of(l, first + k, k * l->rays_each);
            if (!err) err = bd_slicer_pause(l->context->slicer);
        }
    }
    return err;
}

enum bd_err bd_near_lamps_run(const struct bd_pass_context *context,
                              const struct bd_near_lamps_inputs *inputs, struct bd_near_lamps *out,
                              struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    struct landing l = {
        .context = context,
        .inputs = inputs,
        .out = out,
        .sequence = bd_sequence_of(bd_askers_seed(inputs->seed), OF_NEAR_LAMPS),
        .distance = f_sqrt(inputs->points->area),
        .traced = traced,
        .detail = detail,
    };
    *out = (struct bd_near_lamps){0};
    if (inputs->count == 0 || inputs->points->count == 0) return BD_ERR_OK;
    enum bd_err err = list_lamps(&l);
    bd_surface_hits_init(&l.surfaces, inputs->snapshot);
    if (!err && l.lamp_count > 0) err = light_all(&l);
    bd_surface_hits_finish(&l.surfaces);
    free(l.lamps);
    free(l.rays);
    free(l.hits);
    free(l.seen_by);
    free(l.about);
    free(l.segments);
    free(l.hidden);
    if (err) bd_near_lamps_finish(out);
    return err;
}

void bd_near_lamps_finish(struct bd_near_lamps *near)
{
    free(near->reach2);
    free(near->irradiance);
    *near = (struct bd_near_lamps){0};
}
