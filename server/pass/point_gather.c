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
    const struct bd_receiver_part *part;
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
    if (!(white > 0)) return 0;
    return floorf(channel / white * STEPS + 0.5f) * (white / STEPS);
}

static f3 light_of_texel(const struct gathering *g, uint32_t point)
{
    const f3 light = g->inputs->points->radiance[point];
    if (!g->projector.as_printed) return light;
    return f3_of(round_channel(light.x, g->white), round_channel(light.y, g->white),
                 round_channel(light.z, g->white));
}

static f3 in_world(const struct bd_native_place *place, f3 way)
{
    return f3_add(f3_scale(place->across, way.x),
                  f3_add(f3_scale(place->along, way.y), f3_scale(place->normal, way.z)));
}

// What comes through texels, under a normal that may lean.
static void sum_texels(const struct gathering *g, const struct bd_native_place *place, f3 normal,
                       const struct bd_projected *seen, f3 *irradiance, f3 *vector)
{
    const f3 own = in_axes(normal, place->across, place->along, place->normal);
    f3 directions = f3_of(0, 0, 0);
    *irradiance = f3_of(0, 0, 0);
    for (uint32_t t = 0; t < g->map.side * g->map.side; t++) {
        if (seen->point[t] == BD_SEES_NOTHING) continue;
        const f3 light = light_of_texel(g, seen->point[t]), weight = g->map.weight[t];
        *irradiance = f3_add(*irradiance, f3_scale(light, f_max(f3_dot(weight, own), 0)));
        directions = f3_add(directions, f3_scale(weight, all_channels(light)));
    }
    *vector = irradiance_vector(*irradiance, in_world(place, directions), normal);
}

// Cosine under which a texel shows a surface, at least: flatter it would show more of it than a
// block is large.
#define FACING_LEAST 0.05f

// How far off light of what a texel shows may be over a block (kernel/light_spread.h), which takes
// it for a patch that fills the texel.
static float spread_of_texel(const struct gathering *g, const struct bd_native_place *place,
                             const struct bd_receivers *block, uint32_t lane, uint32_t texel,
                             uint32_t seen)
{
    const struct bd_projected_point *point = &g->projector.points->points[seen / 2];
    const f3 from = f3_sub(f3_of(point->x, point->y, point->z), place->position);
    const float r2 = f_max(f3_dot(from, from), NEAREST_R2);
    const f3 front =
        in_axes(normal_of_bits(point->normal), place->across, place->along, place->normal);
    const f3 normal = f3_scale(front, seen % 2 ? -1 : 1), way = g->map.way[texel];
    const float facing = f_max(-f3_dot(normal, way), FACING_LEAST);
    const float area = g->map.solid_angle[texel] * r2 / facing;
    const float flux = F_PI * all_channels(light_of_texel(g, seen)) * area;
    return spread_of_vpl(block->radius[lane], block->off_plane[lane], f3_of(0, 0, 1),
                         f3_scale(way, f_sqrt(r2)), r2, normal, area, flux);
}

static float sum_spread(const struct gathering *g, const struct bd_native_place *place,
                        const struct bd_receivers *block, uint32_t lane,
                        const struct bd_projected *seen)
{
    float sum = 0;
    for (uint32_t t = 0; t < g->map.side * g->map.side; t++)
        if (seen->point[t] != BD_SEES_NOTHING)
            sum += spread_of_texel(g, place, block, lane, t, seen->point[t]);
    return sum;
}

static void light_receiver(const struct gathering *g, const struct bd_point_cut *cut,
                           uint32_t group, uint32_t lane, struct bd_projected *seen)
{
    const struct bd_ray_starts *starts = &g->part->starts[group];
    const f3 normal = f3_at(&g->part->receivers[group].normal, lane);
    const uint32_t chance = bd_stirred(f_bits(starts->place[lane])) ^ (uint32_t)g->inputs->seed;
    const struct bd_native_place place = bd_projected_place(
        f3_at(&starts->position, lane), f3_at(&starts->normal_geometric, lane), chance);
    f3 irradiance, vector;
    bd_project_points(&g->projector, cut, &place, chance, seen);
    sum_texels(g, &place, normal, seen, &irradiance, &vector);
    f3_add_at(&g->part->light[group].irradiance, lane, irradiance);
    f3_add_at(&g->part->light[group].vector, lane, vector);
    const struct bd_receivers *blocks = &g->part->receivers[group];
    if (g->spread && blocks->radius[lane] > 0)
        g->part->light[group].spread[lane] += sum_spread(g, &place, blocks, lane, seen);
}

// --- a group ------------------------------------------------------------------------------------

// Receivers of a group that lie on one surface, as far as that goes: they look at the same points.
// A cut for all of a group that has an edge in it is none that fits, and what is near is drawn too
// rarely.
#define SURFACES_MOST 8u
struct surfaces {
    uint32_t count;
    struct bd_points_about about[SURFACES_MOST];
    f3 position[SURFACES_MOST], normal[SURFACES_MOST]; // of the first of each
    uint32_t of_lane[BD_LANES];                        // SURFACES_MOST: it is not lit
};

// Cosine between normals, and how far off the plane as a part of the distance.
#define ALIKE_LEAST    0.9f
#define OFF_PLANE_MOST 0.1f

static bool lies_on(const struct surfaces *s, uint32_t k, f3 position, f3 normal)
{
    const f3 way = f3_sub(position, s->position[k]);
    const float off = f_abs(f3_dot(s->normal[k], way));
    return f3_dot(s->normal[k], normal) > ALIKE_LEAST && off <= OFF_PLANE_MOST * f3_length(way);
}

// The last takes whatever is left.
static uint32_t surface_of(struct surfaces *s, f3 position, f3 normal)
{
    for (uint32_t k = 0; k < s->count; k++)
        if (lies_on(s, k, position, normal)) return k;
    if (s->count == SURFACES_MOST) return SURFACES_MOST - 1;
    s->position[s->count] = position;
    s->normal[s->count] = normal;
    return s->count++;
}

static void tell_surfaces(const struct gathering *g, uint32_t group, struct surfaces *s)
{
    const struct bd_ray_starts *starts = &g->part->starts[group];
    *s = (struct surfaces){0};
    for (uint32_t lane = 0; lane < BD_LANES; lane++) {
        s->of_lane[lane] = SURFACES_MOST;
        if (group * BD_LANES + lane >= g->part->count) continue;
        if (!(g->part->receivers[group].lit[lane] > 0)) continue;
        const f3 position = f3_at(&starts->position, lane);
        const f3 normal = f3_at(&starts->normal_geometric, lane);
        s->of_lane[lane] = surface_of(s, position, normal);
        bd_points_about_add(&s->about[s->of_lane[lane]], position, normal);
    }
}

static void light_group(void *user, uint32_t group)
{
    const struct gathering *g = user;
    struct bd_projected *seen = malloc(sizeof *seen);
    struct surfaces surfaces;
    struct bd_point_cut cut;
    BD_ASSERT(seen);
    tell_surfaces(g, group, &surfaces);
    for (uint32_t k = 0; k < surfaces.count; k++) {
        bd_point_clusters_cut(&g->inputs->points->clusters, g->inputs->clusters,
                              g->inputs->as_printed ? NULL : &surfaces.about[k].view, &cut);
        for (uint32_t lane = 0; lane < BD_LANES; lane++)
            if (surfaces.of_lane[lane] == k) light_receiver(g, &cut, group, lane, seen);
    }
    free(seen);
}

static double units_of(const struct gathering *g)
{
    const struct bd_projector *p = &g->projector;
    const double points = p->projection == BD_PROJECTION_ALL
                              ? p->points->count
                              : p->exploit + 2.0 * p->explore * g->inputs->clusters;
    return UNITS_PER_POINT * points + UNITS_PER_TEXEL * p->side * p->side;
}

static enum bd_err light_part(void *user, const struct bd_receiver_part *part)
{
    struct gathering *g = user;
    g->part = part;
    bd_slicer_work(g->context.slicer, "project");
    return bd_receivers_each(&g->context, part->group_count, units_of(g) * BD_LANES, light_group,
                             g);
}

static enum bd_err run(const struct bd_pass_context *context,
                       const struct bd_point_gather_inputs *inputs,
                       struct bd_receivers_inputs *receivers, struct bd_err_detail *detail)
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
        .white = inputs->as_printed ? white_of(inputs->points) : 0,
    };
    g.context.processor = &g.processor;
    g.projector.loops = g.processor.loops;
    receivers->pass = "project";
    receivers->starts = true;
    receivers->seed = inputs->seed;
    receivers->light = light_part;
    receivers->user = &g;
    enum bd_err err = inputs->as_printed ? bd_microbuffer_init_even(&g.map, inputs->side, detail)
                                         : bd_microbuffer_init(&g.map, inputs->side, detail);
    if (!err) err = bd_receivers_run(&g.context, receivers, detail);
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
    if (err) return err;
    struct bd_receivers_inputs receivers = {
        .askers = bd_fragment_askers(gather),
        .spread = gather->spread,
        .bind = bd_multires_light_bind,
        .out = *out,
    };
    err = run(context, inputs, &receivers, detail);
    if (err && !gather->into) bd_multires_light_destroy(context->gpu, out);
    return err;
}
