#include "pass/point_sights.h"

#include <stdlib.h>

#include "base/assert.h"
#include "kernel/all_channels.h"
#include "lights/microbuffer.h"
#include "pass/beside.h"
#include "pass/cosine_rays.h"
#include "pass/receivers.h"

// How a place projects: less closely than pixels do, for its light is seen in the mean over many.
#define MAP_SIDE    16u
#define MAP_EXPLOIT 1024u
#define TEXELS      (MAP_SIDE * MAP_SIDE)
// Rays that are on their way at once.
#define RAYS_AT_ONCE 262144u
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_MAP  6000.0
#define UNITS_PER_HIT  20.0
#define UNITS_PER_LOOK 1.0

struct looking {
    struct bd_pass_context context;
    const struct bd_point_cells_inputs *inputs;
    const struct bd_surface_point *places;
    struct bd_point_sights *sights;
    struct bd_cosine_rays rays;
    struct bd_beside ends;
    const struct bd_receiver_part *part;
    struct bd_projector projector;
    struct bd_microbuffer map;
    struct bd_err_detail *detail;
};

static enum bd_err make_room(struct bd_point_sights *s, uint32_t count, uint32_t each,
                             struct bd_err_detail *detail)
{
    s->count = count;
    s->each = each;
    s->sights = calloc((size_t)count * each + 1, sizeof *s->sights);
    s->of_lobes = calloc((size_t)count + 1, sizeof *s->of_lobes);
    if (s->sights && s->of_lobes) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "points", "no memory for what %u places see",
                      count);
}

void bd_point_sights_finish(struct bd_point_sights *s)
{
    free(s->sights);
    free(s->of_lobes);
    *s = (struct bd_point_sights){0};
}

static uint32_t groups_of(uint32_t count)
{
    return (count + BD_LANES - 1) / BD_LANES;
}

static uint32_t end_of_group(uint32_t group, uint32_t count)
{
    const uint32_t end = (group + 1) * BD_LANES;
    return end < count ? end : count;
}

static void see_lobe(const struct looking *l, uint32_t place, const struct bd_point_sight *sight,
                     f3 to_viewer)
{
    const f3 radiance = bd_point_lobes_send(l->inputs->sides->lobes, sight->side, to_viewer);
    l->sights->of_lobes[place] =
        f3_add(l->sights->of_lobes[place], f3_scale(radiance, sight->weight));
}

// --- by points ----------------------------------------------------------------------------------

static f3 way_from(const struct looking *l, uint32_t side, f3 to)
{
    const struct bd_projected_point *point = &l->inputs->points->points[side / 2];
    return f3_unit(f3_sub(to, f3_of(point->x, point->y, point->z)));
}

static void project_place(const struct looking *l, const struct bd_point_cut *cut, uint32_t i,
                          struct bd_projected *seen)
{
    const struct bd_surface_point *at = &l->places[i];
    const uint32_t chance = at->number ^ (uint32_t)l->inputs->seed;
    const struct bd_native_place place = bd_projected_place(at->position, at->normal, chance);
    bd_project_points(&l->projector, cut, &place, chance, seen);
    for (uint32_t t = 0; t < TEXELS; t++) {
        if (seen->point[t] == BD_SEES_NOTHING) continue;
        struct bd_point_sight *sight = &l->sights->sights[(size_t)i * TEXELS + t];
        *sight = (struct bd_point_sight){seen->point[t], l->map.weight[t].z};
        see_lobe(l, i, sight, way_from(l, seen->point[t], at->position));
    }
}

static void project_group(void *user, uint32_t group)
{
    const struct looking *l = user;
    const uint32_t end = end_of_group(group, l->sights->count);
    struct bd_projected *seen = malloc(sizeof *seen);
    struct bd_points_about about = {0};
    struct bd_point_cut cut;
    BD_ASSERT(seen);
    for (uint32_t i = group * BD_LANES; i < end; i++)
        bd_points_about_add(&about, l->places[i].position, l->places[i].normal);
    bd_point_clusters_cut(l->inputs->points, l->inputs->clusters, &about.view, &cut);
    for (uint32_t i = group * BD_LANES; i < end; i++) project_place(l, &cut, i, seen);
    free(seen);
}

enum bd_err bd_point_sights_by_maps(const struct bd_pass_context *context,
                                    const struct bd_point_cells_inputs *inputs,
                                    const struct bd_surface_point *places, uint32_t count,
                                    struct bd_point_sights *sights, struct bd_err_detail *detail)
{
    struct looking l = {.inputs = inputs,
                        .places = places,
                        .sights = sights,
                        .projector = {.loops = context->processor->loops,
                                      .points = inputs->points,
                                      .explore = inputs->explore,
                                      .exploit = MAP_EXPLOIT,
                                      .side = MAP_SIDE,
                                      .as_printed = true}};
    enum bd_err err = make_room(sights, count, TEXELS, detail);
    if (!err) err = bd_microbuffer_init_even(&l.map, MAP_SIDE, detail);
    bd_slicer_work(context->slicer, "cells project");
    if (!err)
        err = bd_receivers_each(context, groups_of(count), UNITS_PER_MAP * BD_LANES, project_group,
                                &l);
    bd_microbuffer_finish(&l.map);
    return err;
}

// --- by rays ------------------------------------------------------------------------------------

static uint8_t lane_of(const struct looking *l, uint32_t ray)
{
    return l->rays.lanes[ray] / BD_COSINE_HALVES;
}

static void see(const struct looking *l, uint32_t ray, uint32_t place, struct bd_point_sight *sight)
{
    const float passes = l->rays.ways ? all_channels(l->rays.ways[ray].weight) / 3 : 1;
    const float *d = l->rays.rays[ray].direction;
    *sight = (struct bd_point_sight){l->ends.near[ray], passes * sight->weight};
    see_lobe(l, place, sight, f3_of(-d[0], -d[1], -d[2]));
}

// Rays from `first` on are of a place. Those whose points are all hidden count as the others do.
static uint32_t see_place(const struct looking *l, uint32_t place, uint32_t first, uint32_t end)
{
    struct bd_point_sight *sights = &l->sights->sights[(size_t)place * l->sights->each];
    uint32_t seen = 0, hidden = 0, next = first;
    for (const uint8_t lane = lane_of(l, first); next < end && lane_of(l, next) == lane; next++)
        hidden += l->ends.near[next] == BD_BESIDE_HIDDEN;
    const float weight = F_PI / (float)(l->sights->each - hidden);
    for (uint32_t i = first; i < next; i++) {
        if (l->ends.near[i] >= BD_BESIDE_HIDDEN) continue;
        sights[seen].weight = weight;
        see(l, i, place, &sights[seen++]);
    }
    return next;
}

static void see_group(void *user, uint32_t group)
{
    const struct looking *l = user;
    const uint32_t end = l->rays.first_ray[group] + l->rays.ray_count[group];
    for (uint32_t i = l->rays.first_ray[group]; i < end;)
        i = see_place(l, l->part->slice.first + group * BD_LANES + lane_of(l, i), i, end);
}

static enum bd_err see_part(void *user, const struct bd_receiver_part *part)
{
    struct looking *l = user;
    l->part = part;
    enum bd_err err =
        bd_cosine_rays_trace(&l->context, &l->rays, part, l->inputs->visibility, l->detail);
    if (!err)
        err = bd_beside_find(&l->context, &l->ends, l->rays.rays, l->rays.hits, l->rays.count,
                             &l->rays.traced, l->detail);
    bd_slicer_work(l->context.slicer, "cells see");
    const double rays = (double)l->rays.count / part->group_count;
    if (!err)
        err = bd_receivers_each(&l->context, part->group_count, UNITS_PER_HIT * (rays + 1),
                                see_group, l);
    return err;
}

enum bd_err bd_point_sights_by_rays(const struct bd_pass_context *context,
                                    const struct bd_point_cells_inputs *inputs,
                                    const struct bd_surface_point *places, uint32_t count,
                                    uint32_t rays, struct bd_point_sights *sights,
                                    struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    struct looking l = {
        .context = *context,
        .inputs = inputs,
        .places = places,
        .sights = sights,
        .rays = {.of_receiver = rays,
                 .seed = inputs->seed,
                 .one_of = 1,
                 .glass = inputs->glass ? inputs->surfaces : NULL},
        .ends = {.points = inputs->points,
                 .visibility = inputs->visibility,
                 .surfaces = inputs->surfaces},
        .detail = detail,
    };
    const struct bd_receivers_inputs receivers = {.points = places,
                                                  .point_count = count,
                                                  .starts = true,
                                                  .seed = inputs->seed,
                                                  .receivers_max = RAYS_AT_ONCE / rays,
                                                  .light = see_part,
                                                  .user = &l};
    enum bd_err err = make_room(sights, count, rays, detail);
    if (!err && count > 0) err = bd_receivers_run(context, &receivers, detail);
    bd_ray_counts_add(traced, l.rays.traced);
    bd_beside_finish(&l.ends);
    bd_cosine_rays_finish(&l.rays);
    return err;
}

// --- what comes ---------------------------------------------------------------------------------

struct summing {
    const struct bd_point_sights *sights;
    const f3 *radiance;
    f3 *irradiance;
};

static void sum_group(void *user, uint32_t group)
{
    const struct summing *s = user;
    const uint32_t each = s->sights->each;
    for (uint32_t i = group * BD_LANES; i < end_of_group(group, s->sights->count); i++) {
        const struct bd_point_sight *sights = s->sights->sights + (size_t)i * each;
        f3 sum = s->sights->of_lobes[i];
        for (uint32_t k = 0; k < each; k++)
            if (sights[k].weight > 0)
                sum = f3_add(sum, f3_scale(s->radiance[sights[k].side], sights[k].weight));
        s->irradiance[i] = sum;
    }
}

enum bd_err bd_point_sights_sum(const struct bd_pass_context *context,
                                const struct bd_point_sights *sights, const f3 *radiance,
                                f3 *irradiance)
{
    struct summing summing = {sights, radiance, irradiance};
    bd_slicer_work(context->slicer, "cells get");
    return bd_receivers_each(context, groups_of(sights->count),
                             UNITS_PER_LOOK * sights->each * BD_LANES, sum_group, &summing);
}
