#include "pass/cache.h"

#include <stdlib.h>
#include <string.h>

#include "kernel/all_channels.h"
#include "lights/surface_hits.h"
#include "pass/cells_beside.h"
#include "pass/cosine_rays.h"
#include "pass/gather_native.h"
#include "pass/native/native.h"

// Rays that look for places, in all about: so many, or so many for each cell.
#define RAYS_LEAST    65536u
#define RAYS_PER_CELL 4u
// Of those that are on their way at once.
#define ROOM_BYTES ((size_t)16 << 20)
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_PLACE 40.0
// Light goes round while that changes what cells get, together, by more than that part of it.
#define CHANGE_LEAST 1e-4
#define ROUNDS_MOST  64u
#define UNITS_PER_LOOK 500.0

struct cache {
    struct bd_pass_context context;
    struct bd_processor processor;
    const struct bd_cache_inputs *inputs;
    struct bd_surface_hits surfaces;
    struct bd_cosine_rays rays;
    float radius;
    // Places that were met, of which there may be so many.
    uint32_t count, room;
    struct bd_surface_point *places;
    uint64_t *numbers;
    struct bd_err_detail *detail;
};

// --- places -------------------------------------------------------------------------------------

// Of each pixel as many as that makes, two at least; of large pictures some pixels alone.
static struct bd_cosine_rays looking(const struct bd_cache_inputs *inputs)
{
    const struct bd_viewpoint *v = inputs->gather->viewpoint;
    const uint64_t pixels = (uint64_t)v->width_px * v->height_px;
    const uint64_t of_cells = (uint64_t)RAYS_PER_CELL * inputs->cells;
    const uint64_t wanted = of_cells > RAYS_LEAST ? of_cells : RAYS_LEAST;
    const uint64_t each = wanted / pixels / BD_COSINE_HALVES * BD_COSINE_HALVES;
    struct bd_cosine_rays rays = {.seed = inputs->far.seed, .one_of = 1};
    rays.of_receiver = each < BD_COSINE_HALVES  ? BD_COSINE_HALVES
                       : each > BD_FAR_RAYS_MAX ? BD_FAR_RAYS_MAX
                                                : (uint32_t)each;
    while (pixels * rays.of_receiver / rays.one_of > wanted) rays.one_of *= 2;
    return rays;
}

// A place without a light side has no normal.
static void place_ray(const struct cache *c, uint32_t ray)
{
    const struct bd_ray_hit *hit = &c->rays.hits[ray];
    const float *d = c->rays.rays[ray].direction;
    struct bd_surface_point *place = &c->places[c->count + ray];
    *place = (struct bd_surface_point){0};
    if (hit->triangle == BD_NO_TRIANGLE) return;
    if (!bd_surface_hit_at(&c->surfaces, hit->triangle, hit->u, hit->v, f3_of(d[0], d[1], d[2]),
                           place))
        *place = (struct bd_surface_point){0};
    c->numbers[c->count + ray] = bd_irradiance_cell_at(place->position, place->normal, c->radius);
}

static void place_group(void *user, uint32_t group)
{
    const struct cache *c = user;
    const uint32_t first = c->rays.first_ray[group];
    for (uint32_t i = first; i < first + c->rays.ray_count[group]; i++) place_ray(c, i);
}

static void keep_places(struct cache *c)
{
    uint32_t kept = c->count;
    for (uint32_t i = c->count; i < c->count + c->rays.count; i++) {
        if (f3_dot(c->places[i].normal, c->places[i].normal) == 0) continue;
        c->places[kept] = c->places[i];
        c->numbers[kept++] = c->numbers[i];
    }
    c->count = kept;
}

static bool grow(struct cache *c, uint32_t more)
{
    if (c->count + more <= c->room) return true;
    c->room = c->count + more + RAYS_LEAST;
    struct bd_surface_point *places = realloc(c->places, c->room * sizeof *places);
    if (places) c->places = places;
    uint64_t *numbers = realloc(c->numbers, c->room * sizeof *numbers);
    if (numbers) c->numbers = numbers;
    return places && numbers;
}

static enum bd_err find_places(void *user, const struct bd_receiver_part *part)
{
    struct cache *c = user;
    enum bd_err err =
        bd_cosine_rays_trace(&c->context, &c->rays, part, c->inputs->far.visibility, c->detail);
    if (!err && !grow(c, c->rays.count))
        err = bd_err_set(c->detail, BD_ERR_NO_MEMORY, "cache_cells", "no memory for their places");
    bd_slicer_work(c->context.slicer, "cache places");
    const double rays = (double)c->rays.count / part->group_count;
    if (!err)
        err = bd_receivers_each(&c->context, part->group_count, UNITS_PER_PLACE * (rays + 1),
                                place_group, c);
    if (!err) keep_places(c);
    return err;
}

static uint32_t receivers_at_once(const struct cache *c)
{
    const size_t groups = ROOM_BYTES / bd_cosine_rays_bytes(&c->rays);
    return (uint32_t)(groups > 1 ? groups : 1) * BD_LANES;
}

static enum bd_err look_around(struct cache *c)
{
    const struct bd_receivers_inputs receivers = {
        .askers = bd_gather_askers(c->inputs->gather),
        .starts = true,
        .glossy = c->rays.enters,
        .seed = c->inputs->far.seed,
        .receivers_max = receivers_at_once(c),
        .light = find_places,
        .user = c,
    };
    return bd_receivers_run(&c->context, &receivers, c->detail);
}

// --- their light --------------------------------------------------------------------------------

static enum bd_err no_memory(const struct cache *c)
{
    return bd_err_set(c->detail, BD_ERR_NO_MEMORY, "cache_cells", "no memory for %u",
                      c->inputs->cells);
}

// What each got, and what falls where its rays ended, which some of those got themselves.
static void go_round(const struct bd_far_sights *sights, const f3 *got, f3 *before, f3 *now,
                     uint32_t count)
{
    bool is_on = true;
    for (uint32_t round = 0; is_on && round < ROUNDS_MOST; round++) {
        double changed = 0, all = 0;
        memcpy(before, now, count * sizeof *now);
        memcpy(now, got, count * sizeof *now);
        for (uint32_t i = 0; i < sights->count; i++) {
            const struct bd_far_sight *sight = &sights->sights[i];
            f3 *to = &now[sight->receiver];
            *to = f3_add(*to, f3_mul(sight->weight, before[sight->cell]));
        }
        for (uint32_t i = 0; i < count; i++) {
            changed += (double)all_channels(f3_abs(f3_sub(now[i], before[i])));
            all += (double)all_channels(now[i]);
        }
        is_on = changed > CHANGE_LEAST * all;
    }
}

static enum bd_err send_round(const struct cache *c, const struct bd_far_sights *sights,
                              struct bd_irradiance_cells *cells)
{
    f3 *got = malloc((cells->count + 1) * sizeof *got);
    f3 *before = malloc((cells->count + 1) * sizeof *before);
    const bool all = got && before;
    if (all) {
        memcpy(got, cells->irradiance, cells->count * sizeof *got);
        go_round(sights, got, before, cells->irradiance, cells->count);
    }
    free(got);
    free(before);
    return all ? bd_slicer_pause(c->context.slicer) : no_memory(c);
}

struct looking_at_caustics {
    const struct bd_photon_map *map;
    const struct bd_surface_point *places;
    struct bd_irradiance_cells *cells;
    float spread;
};

static void look_at_caustics(void *user, uint32_t group)
{
    const struct looking_at_caustics *l = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES && i < l->cells->count; i++) {
        const struct bd_surface_point *at = &l->places[i];
        const f3 more = bd_photon_map_look(l->map, at->position, at->normal, l->spread);
        l->cells->irradiance[i] = f3_add(l->cells->irradiance[i], more);
    }
}

// What lies behind glass again, which rays that end in a cell leave to that.
static enum bd_err add_caustics(struct cache *c, const struct bd_surface_point *places,
                                struct bd_irradiance_cells *cells)
{
    struct looking_at_caustics look = {.map = c->inputs->far.caustics_again,
                                       .places = places,
                                       .cells = cells,
                                       .spread = BD_FAR_CAUSTICS_SPREAD * c->radius};
    if (!look.map) return BD_ERR_OK;
    bd_slicer_work(c->context.slicer, "caustics of cells");
    return bd_receivers_each(&c->context, (cells->count + BD_LANES - 1) / BD_LANES,
                             UNITS_PER_LOOK * BD_LANES, look_at_caustics, &look);
}

static enum bd_err light_places(struct cache *c, const struct bd_surface_point *places,
                                struct bd_irradiance_cells *cells, struct bd_ray_counts *traced)
{
    const struct bd_cache_inputs *in = c->inputs;
    const struct bd_gather_chosen_native_inputs gather = {
        .receivers = {.points = places, .point_count = cells->count, .seed = in->far.seed},
        .list = in->list,
        .rays = in->vpl_rays,
        .visibility = in->far.visibility,
        .of_points = cells->irradiance,
    };
    struct bd_far_sights sights = {.cells = cells};
    struct bd_far_inputs far = in->far;
    if (in->goes_round && far.points) far.sights = &sights;
    enum bd_err err = bd_gather_chosen_native_run(&c->context, &gather, traced, c->detail);
    if (!err)
        err = bd_far_of_points(&c->context, &far, places, cells->count, cells->irradiance, traced,
                               c->detail);
    if (!err) err = add_caustics(c, places, cells);
    if (!err && sights.count > 0) err = send_round(c, &sights, cells);
    free(sights.sights);
    return err;
}

static enum bd_err light_cells(struct cache *c, struct bd_irradiance_cells *cells,
                               struct bd_ray_counts *traced)
{
    struct bd_surface_point *places = malloc((cells->count + 1) * sizeof *places);
    if (!places) return no_memory(c);
    for (uint32_t i = 0; i < cells->count; i++) {
        places[i] = c->places[cells->chosen[i]];
        places[i].number = cells->number[i];
        cells->places[i] = (struct bd_cell_place){places[i].position, places[i].normal};
    }
    enum bd_err err = light_places(c, places, cells, traced);
    if (!err && c->inputs->are_shown)
        err =
            bd_cells_beside_find(&c->context, c->inputs->far.visibility, cells, traced, c->detail);
    free(places);
    return err;
}

static enum bd_err run(struct cache *c, struct bd_irradiance_cells **out,
                       struct bd_ray_counts *traced)
{
    enum bd_err err = look_around(c);
    bd_slicer_work(c->context.slicer, "cache cells");
    if (!err)
        err = bd_irradiance_cells_create(c->numbers, c->count, c->inputs->cells, c->radius, out,
                                         c->detail);
    if (!err) err = bd_slicer_pause(c->context.slicer);
    if (!err) err = light_cells(c, *out, traced);
    return err;
}

enum bd_err bd_cache_run(const struct bd_pass_context *context,
                         const struct bd_cache_inputs *inputs, struct bd_irradiance_cells **out,
                         struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    struct cache c = {
        .context = *context,
        .processor = {inputs->far.visibility->pool, bd_native_loops()},
        .inputs = inputs,
        .rays = looking(inputs),
        .radius = (float)inputs->gather->scene->space.radius,
        .detail = detail,
    };
    c.context.processor = &c.processor;
    c.rays.glass = inputs->far.glass ? &c.surfaces : NULL;
    c.rays.veils = inputs->far.visibility->veils ? &c.surfaces : NULL;
    c.rays.enters = inputs->far.glass == BD_GLASS_PASSES;
    *out = NULL;
    bd_surface_hits_init(&c.surfaces, inputs->far.snapshot);
    bd_gpu_pass_begin(context->gpu, "cache");
    const enum bd_err err = run(&c, out, traced);
    bd_gpu_pass_end(context->gpu);
    bd_ray_counts_add(traced, c.rays.traced);
    if (err) bd_irradiance_cells_destroy(out);
    bd_surface_hits_finish(&c.surfaces);
    bd_cosine_rays_finish(&c.rays);
    free(c.places);
    free(c.numbers);
    return err;
}
