#include "pass/lit_points.h"

#include <stdlib.h>

#include "base/assert.h"
#include "pass/caustic_photons.h"
#include "pass/near_lamps.h"
#include "pass/nearest.h"
#include "pass/point_cells.h"
#include "pass/receivers.h"

// Where transmission is that large a surface is glass, which hides nothing.
#define GLASS_FROM 0.5f
// Of the distance between points: what lies so close over one covers it.
#define COVER_PART 0.1f
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_LOOK 100.0

struct lighting {
    struct bd_pass_context context;
    struct bd_processor processor;
    const struct bd_lit_points_inputs *inputs;
    struct bd_surface_points points;
    // Sides of them that light falls on, point by point in order.
    struct bd_point_sides sides;
    struct bd_surface_point *places;
    uint32_t *radiance_of;
    f3 *first;
    struct bd_surface_hits hits;
    struct bd_lit_points *out;
    struct bd_err_detail *detail;
};

static enum bd_err no_memory(const struct lighting *l)
{
    return bd_err_set(l->detail, BD_ERR_NO_MEMORY, "points", "no memory for %u", l->inputs->count);
}

// --- points -------------------------------------------------------------------------------------

static enum bd_sends sends_of(const struct bd_lit_points_inputs *in)
{
    if (in->lambert) return BD_SENDS_LAMBERT;
    return in->glass ? BD_SENDS_BESIDE_MIRRORS : BD_SENDS_ALL;
}

static void leave_out_glass(struct lighting *l)
{
    const struct bd_scene *scene = l->inputs->snapshot;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < l->points.count; i++) {
        const struct bd_surface_hit hit = bd_surface_hit_of(&l->hits, l->points.points[i].triangle);
        if (scene->materials[hit.primitive->material].transmission < GLASS_FROM)
            l->points.points[kept++] = l->points.points[i];
    }
    l->points.count = kept;
}

static void look_down(const struct lighting *l, struct bd_ray *rays)
{
    const float height = COVER_PART * f_sqrt(l->points.area);
    for (uint32_t i = 0; i < l->points.count; i++) {
        const struct bd_surface_point *at = &l->points.points[i];
        const f3 from = f3_add(at->position, f3_scale(at->normal, height));
        rays[i] = (struct bd_ray){.origin = {from.x, from.y, from.z},
                                  .from_triangle = at->triangle,
                                  .direction = {-at->normal.x, -at->normal.y, -at->normal.z},
                                  .far = 2 * height};
    }
}

// What lies under something else by less than this part of where it is seen from is in one place.
#define ONE_PLACE 0.02f

// Beside its own triangle another one ends, and rounding says whether it is met there.
#define EDGE 1e-3f

static bool is_met_within(const struct bd_ray_hit *hit)
{
    return hit->u > EDGE && hit->v > EDGE && hit->u + hit->v < 1 - EDGE;
}

// Of two in one place the first is there, whatever rounding says of which is met.
static bool is_covered(const struct bd_ray_hit *hit, uint32_t own, float height)
{
    if (hit->triangle == BD_NO_TRIANGLE || hit->distance > (1 + ONE_PLACE) * height) return false;
    if (hit->distance < (1 - ONE_PLACE) * height) return true;
    return hit->triangle < own && is_met_within(hit);
}

// What lies close under something else, or twice in one place, is no surface: a point is what is
// seen from close above it.
static enum bd_err leave_out_covered(struct lighting *l)
{
    const float height = COVER_PART * f_sqrt(l->points.area);
    const uint32_t count = l->points.count;
    struct bd_ray *rays = malloc((count + 1) * sizeof *rays);
    struct bd_ray_hit *hits = malloc((count + 1) * sizeof *hits);
    enum bd_err err = rays && hits ? BD_ERR_OK : no_memory(l);
    if (!err) {
        look_down(l, rays);
        err = bd_nearest_ask(&l->context, &l->inputs->visibility, rays, count, hits,
                             &l->out->traced, l->detail);
    }
    uint32_t kept = 0;
    for (uint32_t i = 0; !err && i < count; i++)
        if (!is_covered(&hits[i], l->points.points[i].triangle, height))
            l->points.points[kept++] = l->points.points[i];
    l->points.count = kept;
    free(rays);
    free(hits);
    return err;
}

static enum bd_err spread_points(struct lighting *l)
{
    const struct bd_lit_points_inputs *in = l->inputs;
    const struct bd_surface_points_how how = {
        .count = in->count,
        .sends = sends_of(in),
        .by_coverage = in->visibility.alpha == BD_RAYS_ALPHA_COVERAGE,
        .once = true,
        .is_kept = true,
        .seed = bd_askers_seed(in->seed),
    };
    bd_slicer_work(l->context.slicer, "surface points");
    enum bd_err err = bd_surface_points_init(&l->points, in->snapshot, &how, bd_slicer_pause,
                                             l->context.slicer, l->detail);
    if (!err && in->glass) leave_out_glass(l);
    return err ? err : leave_out_covered(l);
}

static enum bd_err cluster_points(struct lighting *l)
{
    bd_slicer_work(l->context.slicer, "point clusters");
    const enum bd_err err = bd_point_clusters_init(&l->out->clusters, &l->points, bd_slicer_pause,
                                                   l->context.slicer, l->detail);
    return err ? err : bd_slicer_pause(l->context.slicer);
}

static void add_side(struct lighting *l, const struct bd_surface_point *point, uint32_t radiance)
{
    const uint32_t side = l->sides.count++;
    l->places[side] = *point;
    l->places[side].number = side;
    if (radiance % 2) l->places[side].normal = f3_scale(point->normal, -1);
    l->radiance_of[side] = radiance;
}

static enum bd_err list_sides(struct lighting *l)
{
    const struct bd_point_clusters *clusters = &l->out->clusters;
    const size_t most = 2 * (size_t)clusters->count + 1;
    l->places = malloc(most * sizeof *l->places);
    l->radiance_of = malloc(most * sizeof *l->radiance_of);
    l->first = calloc(most, sizeof *l->first);
    l->out->radiance = calloc(most, sizeof *l->out->radiance);
    if (!l->places || !l->radiance_of || !l->first || !l->out->radiance) return no_memory(l);
    for (uint32_t i = 0; i < clusters->count; i++) {
        const struct bd_surface_point *point = &l->points.points[clusters->order[i]];
        add_side(l, point, 2 * i);
        if (point->is_two_sided) add_side(l, point, 2 * i + 1);
    }
    l->sides.places = l->places;
    l->sides.radiance_of = l->radiance_of;
    l->sides.first = l->first;
    l->sides.lobes = &l->out->lobes;
    if (l->inputs->lambert) return bd_slicer_pause(l->context.slicer);
    const enum bd_err err = bd_point_lobes_init(&l->out->lobes, &l->hits, l->places, l->radiance_of,
                                                l->sides.count, 2 * clusters->count, l->detail);
    return err ? err : bd_slicer_pause(l->context.slicer);
}

// --- their light --------------------------------------------------------------------------------

static enum bd_err send_through_glass(struct lighting *l)
{
    const struct bd_lit_points_inputs *in = l->inputs;
    const struct bd_area_lights *lights = in->first.lights;
    const struct bd_caustic_photons_inputs caustics = {
        .snapshot = in->snapshot,
        .visibility = &in->visibility,
        .punctuals = in->first.punctuals,
        .punctual_count = in->first.punctual_count,
        .emitters = lights && lights->count > 0 ? lights : NULL,
        .from_cd_m2 = (float)(1 / in->space->unit_cd_m2),
        .mirrors_alone = true,
        .count = in->photons,
        .seed = in->seed,
    };
    return bd_caustic_photons_run(&l->context, &caustics, &l->out->caustics, NULL, l->detail);
}

static void look_at_caustics(void *user, uint32_t group)
{
    const struct lighting *l = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES && i < l->sides.count; i++) {
        const struct bd_surface_point *at = &l->places[i];
        const f3 more = bd_photon_map_look(l->out->caustics, at->position, at->normal, 0);
        l->first[i] = f3_add(l->first[i], more);
    }
}

static enum bd_err add_caustics(struct lighting *l)
{
    const enum bd_err err = send_through_glass(l);
    if (err || !l->out->caustics) return err;
    bd_slicer_work(l->context.slicer, "caustics at points");
    return bd_receivers_each(&l->context, (l->sides.count + BD_LANES - 1) / BD_LANES,
                             UNITS_PER_LOOK * BD_LANES, look_at_caustics, l);
}

static enum bd_err find_near_lamps(struct lighting *l, struct bd_near_lamps *near)
{
    const struct bd_lit_points_inputs *in = l->inputs;
    const struct bd_near_lamps_inputs lamps = {
        .snapshot = in->snapshot,
        .visibility = &in->visibility,
        .points = &l->out->clusters,
        .punctuals = in->first.punctuals,
        .count = in->first.punctual_count,
        .glass = in->glass,
        .seed = in->seed,
    };
    return bd_near_lamps_run(&l->context, &lamps, near, &l->out->traced, l->detail);
}

static void add_near_lamps(struct lighting *l, const struct bd_near_lamps *near)
{
    for (uint32_t i = 0; near->irradiance && i < l->sides.count; i++)
        l->first[i] = f3_add(l->first[i], near->irradiance[l->radiance_of[i]]);
}

static f3 keep_ways(void *user, uint32_t side, const struct bd_first_way *ways, uint32_t count)
{
    struct lighting *l = user;
    return bd_point_lobes_keep(&l->out->lobes, &l->hits, &l->places[side], l->radiance_of[side],
                               ways, count);
}

static enum bd_err light_straight(struct lighting *l)
{
    struct bd_first_light first = l->inputs->first;
    struct bd_near_lamps near;
    enum bd_err err = find_near_lamps(l, &near);
    if (err) return err;
    first.near2 = near.reach2;
    if (l->out->lobes.count > 0) {
        first.keep = keep_ways;
        first.keeper = l;
    }
    err =
        bd_first_light_run(&l->context, &first, &l->inputs->visibility, l->inputs->seed, l->places,
                           l->sides.count, NULL, l->first, NULL, &l->out->traced, l->detail);
    if (!err) add_near_lamps(l, &near);
    bd_near_lamps_finish(&near);
    return err;
}

static enum bd_err light_first(struct lighting *l)
{
    enum bd_err err = light_straight(l);
    if (!err && l->inputs->photons > 0) err = add_caustics(l);
    return err ? err : bd_points_send_first(&l->context, &l->sides, l->out->radiance);
}

static enum bd_err light_again(struct lighting *l)
{
    const struct bd_lit_points_inputs *in = l->inputs;
    const struct bd_point_cells_inputs cells = {
        .space = in->space,
        .surfaces = &l->hits,
        .visibility = &in->visibility,
        .sides = &l->sides,
        .points = &l->out->clusters,
        .cells = in->cells,
        .clusters = in->clusters,
        .explore = in->explore,
        .rounds = in->reflections - 1,
        .projected = in->projected,
        .glass = in->glass,
        .seed = in->seed,
    };
    return bd_point_cells_run(&l->context, &cells, l->out->radiance, &l->out->cells,
                              &l->out->rounds, &l->out->traced, l->detail);
}

static enum bd_err light_points(struct lighting *l)
{
    enum bd_err err = list_sides(l);
    if (!err) err = light_first(l);
    if (!err && l->inputs->reflections > 1 && l->sides.count > 0) err = light_again(l);
    return err;
}

static enum bd_err run_pass(struct lighting *l, const char *name,
                            enum bd_err (*work)(struct lighting *l))
{
    bd_gpu_pass_begin(l->context.gpu, name);
    const enum bd_err err = work(l);
    bd_gpu_pass_end(l->context.gpu);
    return err;
}

static enum bd_err run(struct lighting *l)
{
    enum bd_err err = run_pass(l, "points", spread_points);
    if (!err) err = run_pass(l, "point_clusters", cluster_points);
    return err ? err : run_pass(l, "points", light_points);
}

enum bd_err bd_lit_points_run(const struct bd_pass_context *context,
                              const struct bd_lit_points_inputs *inputs, struct bd_lit_points **out,
                              struct bd_err_detail *detail)
{
    struct lighting l = {
        .context = *context,
        .processor = {inputs->visibility.pool, bd_native_loops()},
        .inputs = inputs,
        .out = calloc(1, sizeof *l.out),
        .detail = detail,
    };
    BD_ASSERT(l.out);
    l.context.processor = &l.processor;
    bd_surface_hits_init(&l.hits, inputs->snapshot);
    l.hits.roughest = BD_MIRROR_ROUGHNESS;
    const enum bd_err err = run(&l);
    bd_surface_hits_finish(&l.hits);
    bd_surface_points_finish(&l.points);
    free(l.places);
    free(l.radiance_of);
    free(l.first);
    if (err) bd_lit_points_destroy(context->gpu, &l.out);
    *out = l.out;
    return err;
}

void bd_lit_points_destroy(struct bd_gpu *gpu, struct bd_lit_points **points)
{
    (void)gpu;
    if (!*points) return;
    bd_point_clusters_finish(&(*points)->clusters);
    bd_irradiance_cells_destroy(&(*points)->cells);
    bd_photon_map_destroy(&(*points)->caustics);
    bd_point_lobes_finish(&(*points)->lobes);
    free((*points)->radiance);
    free(*points);
    *points = NULL;
}

f3 bd_lit_points_send(const struct bd_lit_points *points, uint32_t side, f3 to_viewer)
{
    const f3 radiance = points->radiance[side];
    if (points->lobes.count == 0) return radiance;
    return f3_add(radiance, bd_point_lobes_send(&points->lobes, side, to_viewer));
}

f3 bd_lit_points_send_to(const struct bd_lit_points *points, uint32_t side, f3 place)
{
    if (points->lobes.count == 0) return points->radiance[side];
    const struct bd_projected_point *point = &points->clusters.points[side / 2];
    return bd_lit_points_send(points, side,
                              f3_unit(f3_sub(place, f3_of(point->x, point->y, point->z))));
}

uint64_t bd_lit_points_bytes(const struct bd_lit_points *points)
{
    const struct bd_point_clusters *c = &points->clusters;
    const uint64_t each =
        sizeof *c->points + sizeof *c->order + sizeof *c->names + 2 * sizeof *points->radiance;
    return sizeof *points + c->count * each + c->part_count * sizeof *c->parts +
           bd_point_lobes_bytes(&points->lobes, 2 * c->count) +
           (points->cells ? bd_irradiance_cells_bytes(points->cells) : 0) +
           (points->caustics ? bd_photon_map_bytes(points->caustics) : 0);
}
