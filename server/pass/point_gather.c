#include "pass/point_gather.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "kernel/all_channels.h"
#include "kernel/hemi_octahedral.h"
#include "kernel/light_spread.h"
#include "kernel/projected_point.h"
#include "kernel/vpl_light.h"
#include "lights/microbuffer.h"
#include "lights/sequence.h"
#include "pass/f3_arrays.h"
#include "pass/kernels.h"
#include "pass/map_rays.h"
#include "pass/point_gather_device.h"
#include "pass/point_surfaces.h"
#include "pass/receivers.h"

// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_POINT 8.0
#define UNITS_PER_TEXEL 6.0

struct gathering {
    struct bd_pass_context context;
    struct bd_processor processor;
    const struct bd_point_gather_inputs *inputs;
    struct bd_projector projector;
    struct bd_microbuffer map;
    float white; // as printed
    bool spread;
    struct bd_point_gather_device *device; // or NULL
    const struct bd_receiver_part *part;
    struct bd_receiver_sets sets;
    struct bd_map_rays rays;
    struct bd_err_detail *detail;
};

// A thread's room: what a receiver sees, and what it is given by each texel.
struct look {
    struct bd_projected seen;
    float gives[BD_MICROBUFFER_SIDE_MAX * BD_MICROBUFFER_SIDE_MAX];
};

// --- what texels hold ---------------------------------------------------------------------------

// In eight bits, where it is as printed: the paper's texels hold no more. White is the brightest of
// all points.
#define STEPS 255.0f

static float white_of(const struct bd_lit_points *points)
{
    float white = 0;
    for (size_t i = 0; i < 2 * (size_t)points->clusters.count; i++)
        white = f_max(white, strongest_channel(points->radiance[i]));
    return white;
}

static float round_channel(float channel, float white)
{
    if (!(channel < white)) return white;
    return floorf(channel / white * STEPS + 0.5f) * (white / STEPS);
}

static f3 way_to(const struct gathering *g, uint32_t seen, f3 from)
{
    const struct bd_projected_point *point = &g->projector.points->points[seen / 2];
    return f3_sub(f3_of(point->x, point->y, point->z), from);
}

// `seen`: a point's side.
static f3 light_of_texel(const struct gathering *g, uint32_t seen, f3 receiver)
{
    const f3 light = bd_lit_points_send_to(g->inputs->points, seen, receiver);
    if (!g->projector.as_printed) return light;
    return f3_of(round_channel(light.x, g->white), round_channel(light.y, g->white),
                 round_channel(light.z, g->white));
}

struct texel_sums {
    f3 irradiance, directions, noise;
};

// What comes through texels, under a normal that may lean, in the map's axes; and how noisy that
// is. Squares of four are the halves of a chequerboard, and differ by what lies within a square
// where it might lie within the next one: as much, in the mean, as by another map that is turned by
// chance.
static struct texel_sums sum_texels(const struct gathering *g, const struct bd_native_place *place,
                                    f3 own, struct look *look)
{
    const uint32_t side = g->map.side, *seen = look->seen.point;
    f3 directions = f3_of(0, 0, 0), halves[2] = {f3_of(0, 0, 0), f3_of(0, 0, 0)};
    for (uint32_t t = 0; t < side * side; t++) {
        look->gives[t] = 0;
        if (seen[t] == BD_SEES_NOTHING) continue;
        const f3 light = light_of_texel(g, seen[t], place->position);
        const f3 weight = g->map.weight[t];
        const f3 comes = f3_scale(light, f_max(f3_dot(weight, own), 0));
        const uint32_t half = half_of_texel(t % side, t / side);
        halves[half] = f3_add(halves[half], comes);
        look->gives[t] = all_channels(comes);
        directions = f3_add(directions, f3_scale(weight, all_channels(light)));
    }
    const f3 irradiance = f3_add(halves[0], halves[1]);
    return (struct texel_sums){
        .irradiance = irradiance,
        .directions = from_axes(directions, place->across, place->along, place->normal),
        .noise = f3_sub(halves[0], halves[1]),
    };
}

// How far off light of what a texel shows may be over a block.
static float spread_of(const struct gathering *g, const struct bd_native_place *place,
                       const struct bd_receivers *block, uint32_t lane, uint32_t texel,
                       uint32_t seen)
{
    const struct bd_projected_point *point = &g->projector.points->points[seen / 2];
    const f3 from = way_to(g, seen, place->position);
    const float r2 = f_max(f3_dot(from, from), NEAREST_R2);
    const f3 front =
        in_axes(normal_of_bits(point->normal), place->across, place->along, place->normal);
    return spread_of_texel(block->radius[lane], block->off_plane[lane], g->map.way[texel],
                           g->map.solid_angle[texel], r2, f3_scale(front, seen % 2 ? -1 : 1),
                           all_channels(light_of_texel(g, seen, place->position)));
}

static float sum_spread(const struct gathering *g, const struct bd_native_place *place,
                        const struct bd_receivers *block, uint32_t lane,
                        const struct bd_projected *seen)
{
    float sum = 0;
    for (uint32_t t = 0; t < g->map.side * g->map.side; t++)
        if (seen->point[t] != BD_SEES_NOTHING)
            sum += spread_of(g, place, block, lane, t, seen->point[t]);
    return sum;
}

struct bd_native_place bd_point_gather_place(const struct bd_point_gather_inputs *inputs,
                                             const struct bd_ray_starts *starts, uint32_t lane)
{
    const uint32_t chance = bd_stirred(f_bits(starts->place[lane])) ^ (uint32_t)inputs->seed;
    return bd_projected_place(f3_at(&starts->position, lane),
                              f3_at(&starts->normal_geometric, lane), chance);
}

static void light_receiver(const struct gathering *g, const struct bd_point_cut *cut,
                           uint32_t group, uint32_t lane, struct look *look)
{
    const struct bd_ray_starts *starts = &g->part->starts[group];
    const struct bd_receivers *blocks = &g->part->receivers[group];
    struct bd_receiver_light *light = &g->part->light[group];
    const f3 normal = f3_at(&blocks->normal, lane);
    const struct bd_native_place place = bd_point_gather_place(g->inputs, starts, lane);
    const f3 own = in_axes(normal, place.across, place.along, place.normal);
    bd_project_points(&g->projector, cut, &place, place.chance, &look->seen);
    const struct texel_sums sums = sum_texels(g, &place, own, look);
    f3_add_at(&light->irradiance, lane, sums.irradiance);
    f3_add_at(&light->vector, lane, irradiance_vector(sums.irradiance, sums.directions, normal));
    f3_add_at(&light->noise, lane, sums.noise);
    if (g->spread && blocks->radius[lane] > 0)
        light->spread[lane] += sum_spread(g, &place, blocks, lane, &look->seen);
    if (g->inputs->rays == 0) return;
    const size_t slots = bd_map_ray_slots(g->inputs);
    bd_map_rays_choose(&g->rays, own, look->seen.point, look->gives, place.chance,
                       g->rays.chosen + (group * BD_LANES + lane) * slots);
}

// --- a set --------------------------------------------------------------------------------------

static void light_set(void *user, uint32_t number)
{
    const struct gathering *g = user;
    const struct bd_receiver_set set = bd_receiver_set_at(&g->sets, number);
    struct look *look = malloc(sizeof *look);
    struct bd_point_surfaces surfaces;
    struct bd_point_cut cut;
    BD_ASSERT(look);
    bd_point_surfaces_of(g->part, &set, &surfaces);
    for (uint32_t k = 0; k < surfaces.count; k++) {
        bd_point_clusters_cut(&g->inputs->points->clusters, g->inputs->clusters,
                              g->inputs->as_printed ? NULL : &surfaces.about[k].view, &cut);
        for (uint32_t i = 0; i < set.count; i++)
            if (surfaces.of_place[i] == k)
                light_receiver(g, &cut, set.places[i] / BD_LANES, set.places[i] % BD_LANES, look);
    }
    free(look);
}

double bd_point_gather_units(const struct bd_point_gather_inputs *inputs)
{
    const double points = inputs->projection == BD_PROJECTION_ALL
                              ? inputs->points->clusters.count
                              : inputs->exploit + 2.0 * inputs->explore * inputs->clusters;
    return UNITS_PER_POINT * points + UNITS_PER_TEXEL * inputs->side * inputs->side;
}

static enum bd_err light_sets(struct gathering *g)
{
    if (g->device)
        return bd_point_gather_device_light(g->device, g->part, &g->sets, g->rays.chosen);
    bd_slicer_work(g->context.slicer, "project");
    return bd_receivers_each(&g->context, g->sets.count,
                             bd_point_gather_units(g->inputs) * BD_SET_MOST, light_set, g);
}

static enum bd_err light_part(void *user, const struct bd_receiver_part *part)
{
    struct gathering *g = user;
    g->part = part;
    const bool sends_rays = g->inputs->rays > 0;
    enum bd_err err = bd_receiver_sets_init(&g->sets, part, g->detail);
    if (!err && sends_rays) err = bd_map_rays_begin(&g->rays, part, g->detail);
    if (!err) err = light_sets(g);
    if (!err && sends_rays) err = bd_map_rays_run(&g->context, &g->rays, g->detail);
    bd_receiver_sets_finish(&g->sets);
    return err;
}

// What is printed is compared, and the processor's.
static enum bd_err begin_device(struct gathering *g, const struct bd_pass_context *context,
                                struct bd_err_detail *detail)
{
    if (context->processor || g->inputs->as_printed) return BD_ERR_OK;
    return bd_point_gather_device_begin(context, g->inputs, &g->map, g->spread, &g->device, detail);
}

static enum bd_err run(const struct bd_pass_context *context,
                       const struct bd_point_gather_inputs *inputs,
                       struct bd_receivers_inputs *receivers, struct bd_ray_counts *traced,
                       struct bd_err_detail *detail)
{
    struct gathering g = {
        .context = *context,
        .processor = {inputs->pool, bd_native_loops()},
        .inputs = inputs,
        .projector = {.points = &inputs->points->clusters,
                      .explore = inputs->explore,
                      .exploit = inputs->exploit,
                      .side = inputs->side,
                      .projection = inputs->projection,
                      .as_printed = inputs->as_printed},
        .spread = receivers->spread,
        .rays = {.inputs = inputs},
        .white = inputs->as_printed ? white_of(inputs->points) : 0,
        .detail = detail,
    };
    g.context.processor = &g.processor;
    g.projector.loops = g.processor.loops;
    receivers->pass = "project";
    receivers->starts = true;
    receivers->seed = inputs->seed;
    receivers->light = light_part;
    if (inputs->rays > 0) receivers->receivers_max = bd_map_rays_at_once(inputs);
    g.rays.map = &g.map;
    receivers->user = &g;
    enum bd_err err = inputs->as_printed ? bd_microbuffer_init_even(&g.map, inputs->side, detail)
                                         : bd_microbuffer_init(&g.map, inputs->side, detail);
    if (!err) err = begin_device(&g, context, detail);
    if (!err) err = bd_receivers_run(&g.context, receivers, detail);
    bd_ray_counts_add(traced, g.rays.traced);
    bd_map_rays_finish(&g.rays);
    bd_point_gather_device_end(&g.device);
    bd_microbuffer_finish(&g.map);
    return err;
}

enum bd_err bd_point_gather_of_fragments(const struct bd_pass_context *context,
                                         const struct bd_point_gather_inputs *inputs,
                                         const struct bd_gather_fragments_inputs *gather,
                                         struct bd_multires_light **out,
                                         struct bd_err_detail *detail)
{
    *out = gather->into;
    enum bd_err err = BD_ERR_OK;
    if (!gather->into)
        err = bd_multires_light_create(context->gpu, &gather->fragments->layout,
                                       bd_fragment_vectors(gather), out, detail);
    if (!err && inputs->noise && !gather->into)
        err = bd_multires_light_add_noise(context->gpu, *out, detail);
    if (err) {
        if (!gather->into) bd_multires_light_destroy(context->gpu, out);
        return err;
    }
    struct bd_receivers_inputs receivers = {
        .askers = bd_fragment_askers(gather),
        .spread = gather->spread,
        .noise = (*out)->fine_noise != NULL,
        .bind = bd_multires_light_bind,
        .out = *out,
    };
    err = run(context, inputs, &receivers, &(*out)->rays, detail);
    if (err && !gather->into) bd_multires_light_destroy(context->gpu, out);
    return err;
}
