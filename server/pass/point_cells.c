#include "pass/point_cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "kernel/all_channels.h"
#include "lights/directions.h"
#include "lights/microbuffer.h"
#include "lights/surface_hits.h"
#include "pass/cosine_rays.h"
#include "pass/nearest.h"
#include "pass/point_ends.h"
#include "pass/point_walk.h"

// Of a cell.
#define RAYS 64u
// In the mean: of fewer a cell would be smaller than what it tells, and leave the rest dark.
#define PLACES_OF_CELL 16u
#define CELLS_LEAST    64u
// Of a side in whose place are cells of surfaces alone that look elsewhere, by this cosine or less.
#define OF_OTHERS (BD_NO_CELL - 1)
#define ELSEWHERE 0.01f
// How a cell projects: less closely than pixels do, for its light is seen in the mean over many.
#define MAP_SIDE    16u
#define MAP_EXPLOIT 1024u
#define TEXELS      (MAP_SIDE * MAP_SIDE)
// Light goes on while a round changes what cells get, together, by more than that part of it.
#define CHANGE_LEAST 1e-3
// Receivers whose rays are on their way at once.
#define AT_ONCE 4096u
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_MAP  6000.0
#define UNITS_PER_HIT  20.0
#define UNITS_PER_LOOK 1.0
#define UNITS_PER_SIDE 1.0

// What is seen: a radiance of all, and how much of it comes.
struct sight {
    uint32_t of;
    float weight;
};

struct cells {
    struct bd_pass_context context;
    const struct bd_point_cells_inputs *inputs;
    struct bd_irradiance_cells *cells;
    struct bd_point_walk walk;
    uint32_t *cell_of; // each side's, or BD_NO_CELL, OF_OTHERS
    uint32_t sights_each;
    struct sight *sights;
    f3 *of_lobes; // that each sees
    f3 *before;   // what each got
    f3 *radiance;
    struct bd_surface_hits hits;
    struct bd_cosine_rays rays;
    const struct bd_receiver_part *part;
    struct bd_projector projector;
    struct bd_microbuffer map;
    struct bd_err_detail *detail;
};

static enum bd_err no_memory(const struct cells *c)
{
    return bd_err_set(c->detail, BD_ERR_NO_MEMORY, "cache_cells", "no memory for %u",
                      c->inputs->cells);
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

// --- what sides send ----------------------------------------------------------------------------

struct sending {
    const struct bd_point_sides *sides;
    f3 *radiance;
};

static void send_first(void *user, uint32_t group)
{
    const struct sending *s = user;
    for (uint32_t i = group * BD_LANES; i < end_of_group(group, s->sides->count); i++)
        s->radiance[s->sides->radiance_of[i]] =
            bd_point_side_sends(s->sides, i, s->sides->first[i]);
}

enum bd_err bd_points_send_first(const struct bd_pass_context *context,
                                 const struct bd_point_sides *sides, f3 *radiance)
{
    struct sending sending = {sides, radiance};
    bd_slicer_work(context->slicer, "points send");
    return bd_receivers_each(context, groups_of(sides->count), UNITS_PER_SIDE * BD_LANES,
                             send_first, &sending);
}

static void send_all(void *user, uint32_t group)
{
    const struct cells *c = user;
    const struct bd_point_sides *sides = c->inputs->sides;
    for (uint32_t i = group * BD_LANES; i < end_of_group(group, sides->count); i++) {
        f3 irradiance = sides->first[i];
        if (c->cell_of[i] < c->cells->count)
            irradiance = f3_add(irradiance, c->cells->irradiance[c->cell_of[i]]);
        c->radiance[sides->radiance_of[i]] = bd_point_side_sends(sides, i, irradiance);
    }
}

static enum bd_err send_on(struct cells *c)
{
    bd_slicer_work(c->context.slicer, "points send");
    return bd_receivers_each(&c->context, groups_of(c->inputs->sides->count),
                             UNITS_PER_SIDE * BD_LANES, send_all, c);
}

// --- cells --------------------------------------------------------------------------------------

static const struct bd_surface_point *place_of(const struct cells *c, uint32_t cell)
{
    return &c->walk.places[c->cells->chosen[cell]];
}

static enum bd_err make_cells(struct cells *c)
{
    const float radius = (float)c->inputs->space->radius;
    const uint32_t count = c->walk.count;
    const uint32_t dense = count / PLACES_OF_CELL + CELLS_LEAST;
    const uint32_t most = c->inputs->cells < dense ? c->inputs->cells : dense;
    uint64_t *numbers = malloc((count + 1) * sizeof *numbers);
    if (!numbers) return no_memory(c);
    for (uint32_t i = 0; i < count; i++) {
        const struct bd_surface_point *at = &c->walk.places[i];
        numbers[i] = bd_irradiance_cell_at(at->position, at->normal, radius);
    }
    const enum bd_err err =
        bd_irradiance_cells_create(numbers, count, most, radius, &c->cells, c->detail);
    free(numbers);
    return err;
}

static enum bd_err make_room(struct cells *c)
{
    const size_t count = c->cells->count + 1;
    c->sights_each = c->inputs->projected ? TEXELS : RAYS;
    c->sights = calloc(count * c->sights_each, sizeof *c->sights);
    c->of_lobes = calloc(count, sizeof *c->of_lobes);
    c->before = calloc(count, sizeof *c->before);
    const bool all = c->sights && c->of_lobes && c->before;
    return all ? bd_slicer_pause(c->context.slicer) : no_memory(c);
}

// Where a wall is thin a cell may be of its other side, or of a wall that meets it there.
static uint32_t cell_at(const struct cells *c, const struct bd_surface_point *at)
{
    const uint32_t cell = bd_irradiance_cells_find(c->cells, at->position, at->normal);
    if (cell == BD_NO_CELL) return cell;
    return f3_dot(place_of(c, cell)->normal, at->normal) < ELSEWHERE ? OF_OTHERS : cell;
}

static void find_cells(void *user, uint32_t group)
{
    const struct cells *c = user;
    const struct bd_point_sides *sides = c->inputs->sides;
    for (uint32_t i = group * BD_LANES; i < end_of_group(group, sides->count); i++)
        c->cell_of[i] = cell_at(c, &sides->places[i]);
}

static enum bd_err find_all(struct cells *c)
{
    bd_slicer_work(c->context.slicer, "cells of sides");
    return bd_receivers_each(&c->context, groups_of(c->inputs->sides->count),
                             UNITS_PER_SIDE * BD_LANES, find_cells, c);
}

// Sides among cells of others, where no walk came: they start. How many.
static uint32_t start_strangers(struct cells *c)
{
    const struct bd_point_sides *sides = c->inputs->sides;
    uint32_t count = 0;
    for (uint32_t i = 0; i < sides->count; i++) {
        if (c->cell_of[i] != OF_OTHERS) continue;
        c->walk.starts[count] = sides->places[i];
        c->walk.starts[count++].number = c->inputs->points->names[sides->radiance_of[i] / 2];
    }
    return count;
}

// Those become places, too, who look one way and see where the walk came to: from within a wall
// none does.
static enum bd_err add_strangers(struct cells *c, struct bd_ray_counts *traced)
{
    const uint32_t count = start_strangers(c);
    const enum bd_err err = bd_point_walk_look(&c->context, &c->walk, count, traced, c->detail);
    for (uint32_t i = 0; !err && i < count; i++) {
        struct bd_surface_point seen;
        if (bd_point_walk_sees(&c->walk, i, &seen) && cell_at(c, &seen) < c->cells->count)
            c->walk.places[c->walk.count++] = c->walk.starts[i];
    }
    return err;
}

// Of the places that the walk came to; then, if those of some sides are of others alone, of those,
// too.
static enum bd_err place_cells(struct cells *c, struct bd_ray_counts *traced)
{
    c->cell_of = malloc((c->inputs->sides->count + 1) * sizeof *c->cell_of);
    if (!c->cell_of) return no_memory(c);
    enum bd_err err = make_cells(c);
    if (!err) err = find_all(c);
    const uint32_t walked = c->walk.count;
    if (!err) err = add_strangers(c, traced);
    if (err || c->walk.count == walked) return err;
    bd_irradiance_cells_destroy(&c->cells);
    err = make_cells(c);
    return err ? err : find_all(c);
}

static void see_lobe(const struct cells *c, uint32_t cell, const struct sight *sight, f3 to_viewer)
{
    const f3 radiance = bd_point_lobes_send(c->inputs->sides->lobes, sight->of, to_viewer);
    c->of_lobes[cell] = f3_add(c->of_lobes[cell], f3_scale(radiance, sight->weight));
}

// --- by points ----------------------------------------------------------------------------------

static f3 way_from(const struct cells *c, uint32_t side, f3 to)
{
    const struct bd_projected_point *point = &c->inputs->points->points[side / 2];
    return f3_unit(f3_sub(to, f3_of(point->x, point->y, point->z)));
}

static void project_cell(const struct cells *c, const struct bd_point_cut *cut, uint32_t cell,
                         struct bd_projected *seen)
{
    const struct bd_surface_point *at = place_of(c, cell);
    const uint32_t chance = c->cells->number[cell] ^ (uint32_t)c->inputs->seed;
    const struct bd_native_place place = bd_projected_place(at->position, at->normal, chance);
    bd_project_points(&c->projector, cut, &place, chance, seen);
    for (uint32_t t = 0; t < TEXELS; t++) {
        if (seen->point[t] == BD_SEES_NOTHING) continue;
        struct sight *sight = &c->sights[(size_t)cell * TEXELS + t];
        *sight = (struct sight){seen->point[t], c->map.weight[t].z};
        see_lobe(c, cell, sight, way_from(c, seen->point[t], at->position));
    }
}

static void project_group(void *user, uint32_t group)
{
    const struct cells *c = user;
    struct bd_projected *seen = malloc(sizeof *seen);
    struct bd_points_about about = {0};
    struct bd_point_cut cut;
    BD_ASSERT(seen);
    for (uint32_t i = group * BD_LANES; i < end_of_group(group, c->cells->count); i++) {
        const struct bd_surface_point *at = place_of(c, i);
        bd_points_about_add(&about, at->position, at->normal);
    }
    bd_point_clusters_cut(c->inputs->points, c->inputs->clusters, &about.view, &cut);
    for (uint32_t i = group * BD_LANES; i < end_of_group(group, c->cells->count); i++)
        project_cell(c, &cut, i, seen);
    free(seen);
}

static enum bd_err look_by_points(struct cells *c)
{
    enum bd_err err = bd_microbuffer_init_even(&c->map, MAP_SIDE, c->detail);
    c->projector = (struct bd_projector){.loops = c->context.processor->loops,
                                         .points = c->inputs->points,
                                         .explore = c->inputs->explore,
                                         .exploit = MAP_EXPLOIT,
                                         .side = MAP_SIDE,
                                         .as_printed = true};
    bd_slicer_work(c->context.slicer, "cells project");
    if (!err)
        err = bd_receivers_each(&c->context, groups_of(c->cells->count), UNITS_PER_MAP * BD_LANES,
                                project_group, c);
    return err;
}

// --- by rays ------------------------------------------------------------------------------------

// Whether there is a point where the ray ends, and how much of its light comes.
static bool see(const struct cells *c, uint32_t ray, struct sight *sight)
{
    const float passes = c->rays.ways ? all_channels(c->rays.ways[ray].weight) / 3 : 1;
    const uint32_t near =
        bd_point_at_end(&c->hits, c->inputs->points, &c->rays.rays[ray], &c->rays.hits[ray]);
    if (near == BD_NO_POINT_NEAR) return false;
    *sight = (struct sight){near, passes * F_PI / RAYS};
    return true;
}

static void see_group(void *user, uint32_t group)
{
    const struct cells *c = user;
    const uint32_t first = c->rays.first_ray[group];
    uint32_t seen[BD_LANES] = {0};
    for (uint32_t i = first; i < first + c->rays.ray_count[group]; i++) {
        const uint32_t lane = c->rays.lanes[i] / BD_COSINE_HALVES;
        const size_t cell = c->part->slice.first + group * BD_LANES + lane;
        struct sight *sight = &c->sights[cell * RAYS + seen[lane]];
        if (seen[lane] == RAYS || !see(c, i, sight)) continue;
        const float *d = c->rays.rays[i].direction;
        see_lobe(c, (uint32_t)cell, sight, f3_of(-d[0], -d[1], -d[2]));
        seen[lane]++;
    }
}

static enum bd_err see_part(void *user, const struct bd_receiver_part *part)
{
    struct cells *c = user;
    c->part = part;
    enum bd_err err =
        bd_cosine_rays_trace(&c->context, &c->rays, part, c->inputs->visibility, c->detail);
    bd_slicer_work(c->context.slicer, "cells see");
    const double rays = (double)c->rays.count / part->group_count;
    if (!err)
        err = bd_receivers_each(&c->context, part->group_count, UNITS_PER_HIT * (rays + 1),
                                see_group, c);
    return err;
}

static enum bd_err look_by_rays(struct cells *c, struct bd_ray_counts *traced)
{
    struct bd_surface_point *places = malloc((c->cells->count + 1) * sizeof *places);
    if (!places) return no_memory(c);
    for (uint32_t i = 0; i < c->cells->count; i++) {
        places[i] = *place_of(c, i);
        places[i].number = c->cells->number[i];
    }
    const struct bd_receivers_inputs receivers = {.points = places,
                                                  .point_count = c->cells->count,
                                                  .starts = true,
                                                  .seed = c->inputs->seed,
                                                  .receivers_max = AT_ONCE,
                                                  .light = see_part,
                                                  .user = c};
    c->rays = (struct bd_cosine_rays){.of_receiver = RAYS,
                                      .seed = c->inputs->seed,
                                      .one_of = 1,
                                      .glass = c->inputs->glass ? &c->hits : NULL};
    const enum bd_err err = bd_receivers_run(&c->context, &receivers, c->detail);
    bd_ray_counts_add(traced, c->rays.traced);
    bd_cosine_rays_finish(&c->rays);
    free(places);
    return err;
}

// --- rounds -------------------------------------------------------------------------------------

static void get_light(void *user, uint32_t group)
{
    const struct cells *c = user;
    for (uint32_t i = group * BD_LANES; i < end_of_group(group, c->cells->count); i++) {
        const struct sight *sights = c->sights + (size_t)i * c->sights_each;
        f3 sum = c->of_lobes[i];
        for (uint32_t k = 0; k < c->sights_each; k++)
            if (sights[k].weight > 0)
                sum = f3_add(sum, f3_scale(c->radiance[sights[k].of], sights[k].weight));
        c->cells->irradiance[i] = sum;
    }
}

// Whether the last round changed enough; keeps what it made.
static bool goes_on(const struct cells *c)
{
    double changed = 0, all = 0;
    for (uint32_t i = 0; i < c->cells->count; i++) {
        const f3 now = c->cells->irradiance[i];
        changed += all_channels(f3_abs(f3_sub(now, c->before[i])));
        all += all_channels(now);
        c->before[i] = now;
    }
    return changed > CHANGE_LEAST * all;
}

static enum bd_err go_round(struct cells *c, uint32_t *rounds)
{
    enum bd_err err = BD_ERR_OK;
    for (bool is_on = true; !err && is_on && *rounds < c->inputs->rounds; ++*rounds) {
        bd_slicer_work(c->context.slicer, "cells get");
        err = bd_receivers_each(&c->context, groups_of(c->cells->count),
                                UNITS_PER_LOOK * c->sights_each * BD_LANES, get_light, c);
        if (!err) err = send_on(c);
        is_on = goes_on(c);
    }
    return err;
}

static enum bd_err light_cells(struct cells *c, uint32_t *rounds, struct bd_ray_counts *traced)
{
    enum bd_err err = make_room(c);
    if (!err) err = c->inputs->projected ? look_by_points(c) : look_by_rays(c, traced);
    return err ? err : go_round(c, rounds);
}

enum bd_err bd_point_cells_run(const struct bd_pass_context *context,
                               const struct bd_point_cells_inputs *inputs, f3 *radiance,
                               struct bd_irradiance_cells **out, uint32_t *rounds,
                               struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    struct cells c = {
        .context = *context, .inputs = inputs, .radiance = radiance, .detail = detail};
    bd_surface_hits_init(&c.hits, inputs->snapshot);
    c.hits.roughest = BD_MIRROR_ROUGHNESS;
    bd_slicer_work(context->slicer, "cells of points");
    c.walk = (struct bd_point_walk){.inputs = inputs, .hits = &c.hits, .radiance = radiance};
    enum bd_err err = bd_point_walk_run(&c.context, &c.walk, traced, detail);
    if (!err) err = place_cells(&c, traced);
    if (!err && c.cells->count > 0) err = light_cells(&c, rounds, traced);
    bd_surface_hits_finish(&c.hits);
    bd_microbuffer_finish(&c.map);
    bd_point_walk_finish(&c.walk);
    free(c.cell_of);
    free(c.sights);
    free(c.of_lobes);
    free(c.before);
    if (err) bd_irradiance_cells_destroy(&c.cells);
    *out = c.cells;
    return err;
}
