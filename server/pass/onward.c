#include "pass/onward.h"

#include <math.h>
#include <stdlib.h>

#include "kernel/brdf.h"
#include "lights/sequence.h"
#include "pass/nearest.h"
#include "pass/receivers.h"

// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_WALL 60.0
// Numbers that nobody else of a frame draws by its seed; each wall has two pairs.
#define PURPOSE 0x6f6e0000u

const struct bd_way bd_way_begins = {.weight = {1, 1, 1}, .straight = true, .rest = 1};

struct onward {
    const struct bd_pass_context *context;
    const struct bd_surface_hits *surfaces;
    enum bd_carries carries;
    bool looks_straight; // others do
    uint32_t seed;
    const uint32_t *numbers;
    struct bd_ray *rays;
    struct bd_ray_hit *hits;
    struct bd_way *ways;
    const struct bd_onward_look *look;
    // Of those that are still on their way: which, and what is asked next.
    uint32_t count;
    uint32_t *which;
    struct bd_ray *next;
    struct bd_ray_hit *met;
    bool *goes_on;
};

// --- a wall -------------------------------------------------------------------------------------

// Whether it is glass that is met, and the three numbers of the wall.
static float draw(uint32_t seed, uint32_t number, uint32_t wall, float facet_and_way[3])
{
    const struct bd_sequence of_facet = bd_sequence_of(seed, PURPOSE + 2 * wall);
    const struct bd_sequence of_way = bd_sequence_of(seed, PURPOSE + 2 * wall + 1);
    float way[2];
    bd_sequence_pair(&of_facet, number, facet_and_way);
    bd_sequence_pair(&of_way, number, way);
    facet_and_way[2] = way[0];
    return way[1];
}

// What it goes through behind the wall, and within what: of a reflection what it came through.
static void enter_medium(const struct bd_surface_hits *surfaces, const struct bd_interface *at,
                         const struct bd_solid_edge *edge, bool passes, struct bd_way *way)
{
    if (at->thin) return;
    way->extinction = passes == at->entering ? edge->inside : edge->outside;
    if (passes) bd_solids_cross(surfaces, &way->solids, at);
}

static void leave(const struct bd_surface_hits *surfaces, const struct bd_interface *at,
                  const struct bd_solid_edge *edge, const struct bd_onward *onward,
                  struct bd_ray *ray, struct bd_way *way)
{
    const f3 d = onward->direction;
    *ray = (struct bd_ray){.origin = {at->position.x, at->position.y, at->position.z},
                           .from_triangle = at->triangle,
                           .direction = {d.x, d.y, d.z},
                           .far = INFINITY};
    way->weight = f3_mul(way->weight, onward->weight);
    enter_medium(surfaces, at, edge, onward->passes, way);
    way->straight &= onward->passes && bd_interface_is_pane(at);
    way->events++;
}

// Where another solid is on both sides nothing happens.
static bool choose(struct bd_interface *at, const struct bd_solid_edge *edge, f3 direction,
                   const float number[3], struct bd_onward *onward)
{
    at->ior = edge->ior;
    if (!edge->is_none) return bd_interface_go_on(at, direction, BD_ONWARD_EITHER, number, onward);
    *onward = (struct bd_onward){direction, {1, 1, 1}, 1, true};
    return true;
}

static void lose(struct onward *o, uint32_t i)
{
    o->ways[i].weight = f3_of(0, 0, 0);
    o->hits[i] = (struct bd_ray_hit){.triangle = BD_NO_TRIANGLE};
}

// True where ray `i` goes on from what it met.
static bool go_on(struct onward *o, uint32_t i)
{
    const struct bd_ray_hit *hit = &o->hits[i];
    struct bd_way *way = &o->ways[i];
    const float *to = o->rays[i].direction;
    const f3 d = f3_of(to[0], to[1], to[2]);
    struct bd_interface at;
    struct bd_onward onward;
    float number[3];
    if (hit->triangle == BD_NO_TRIANGLE) return false;
    const bool is_glass = bd_interface_at(o->surfaces, hit->triangle, hit->u, hit->v, d, &at);
    const struct bd_solid_edge edge =
        is_glass ? bd_solid_edge_at(o->surfaces, &way->solids, &at) : (struct bd_solid_edge){0};
    const f3 extinction = !is_glass || at.thin ? way->extinction
                          : at.entering        ? edge.outside
                                               : edge.inside;
    way->weight = bd_interface_absorbed(way->weight, extinction, hit->distance);
    if (!is_glass) return false;
    if (o->look && at.mirrors && at.alpha > ggx_alpha(BD_MIRROR_ROUGHNESS))
        o->look->look(o->look->user, i, &at, &o->rays[i], hit, way);
    if (draw(o->seed, o->numbers[i], way->events, number) >= at.share) {
        way->rest = f_max(1 - at.share, BD_REST_LEAST);
        return false;
    }
    if (way->events == BD_ONWARD_EVENTS_MAX || !choose(&at, &edge, d, number, &onward)) {
        lose(o, i);
        return false;
    }
    if (o->carries == BD_CARRIES_RADIANCE) onward.weight = f3_scale(onward.weight, onward.spread);
    leave(o->surfaces, &at, &edge, &onward, &o->rays[i], way);
    way->straight &= o->looks_straight;
    return true;
}

static void go_on_group(void *user, uint32_t group)
{
    struct onward *o = user;
    for (uint32_t k = group * BD_LANES; k < (group + 1) * BD_LANES && k < o->count; k++)
        o->goes_on[k] = go_on(o, o->which[k]);
}

// --- all ----------------------------------------------------------------------------------------

static void close_ranks(struct onward *o)
{
    uint32_t left = 0;
    for (uint32_t k = 0; k < o->count; k++) {
        if (!o->goes_on[k]) continue;
        o->which[left] = o->which[k];
        o->next[left++] = o->rays[o->which[k]];
    }
    o->count = left;
}

static enum bd_err make_room(struct onward *o, uint32_t count, struct bd_err_detail *detail)
{
    const size_t room = (size_t)count + 1;
    o->which = malloc(room * sizeof *o->which);
    o->next = malloc(room * sizeof *o->next);
    o->met = malloc(room * sizeof *o->met);
    o->goes_on = malloc(room * sizeof *o->goes_on);
    if (o->which && o->next && o->met && o->goes_on) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "far_rays", "no memory for %u rays", count);
}

enum bd_err bd_onward_run(const struct bd_pass_context *context,
                          const struct bd_surface_hits *surfaces,
                          const struct bd_visibility_inputs *visibility, enum bd_carries carries,
                          uint64_t seed, const uint32_t *numbers, struct bd_ray *rays,
                          struct bd_ray_hit *hits, struct bd_way *ways, uint32_t count,
                          const struct bd_onward_look *look, struct bd_ray_counts *traced,
                          struct bd_err_detail *detail)
{
    struct onward o = {.context = context,
                       .surfaces = surfaces,
                       .carries = carries,
                       .looks_straight = visibility->panes != NULL,
                       .seed = (uint32_t)(seed ^ seed >> 32),
                       .numbers = numbers,
                       .rays = rays,
                       .hits = hits,
                       .ways = ways,
                       .look = look,
                       .count = count};
    enum bd_err err = make_room(&o, count, detail);
    for (uint32_t i = 0; !err && i < count; i++) o.which[i] = i;
    while (!err && o.count > 0) {
        const uint32_t groups = (o.count + BD_LANES - 1) / BD_LANES;
        bd_slicer_work(context->slicer, "onward");
        err = bd_receivers_each(context, groups, UNITS_PER_WALL * BD_LANES, go_on_group, &o);
        if (err) break;
        close_ranks(&o);
        err = bd_nearest_ask(context, visibility, o.next, o.count, o.met, traced, detail);
        for (uint32_t k = 0; !err && k < o.count; k++) hits[o.which[k]] = o.met[k];
    }
    free(o.which);
    free(o.next);
    free(o.met);
    free(o.goes_on);
    return err;
}

bool bd_onward_enter(const struct bd_surface_hits *surfaces, const struct bd_interface *at,
                     f3 to_viewer, uint64_t seed, uint32_t number, struct bd_ray *ray,
                     struct bd_way *way)
{
    struct bd_onward onward;
    float numbers[3];
    (void)draw((uint32_t)(seed ^ seed >> 32), number, 0, numbers);
    *way = bd_way_begins;
    if (!bd_interface_go_on(at, f3_scale(to_viewer, -1), BD_ONWARD_PASSES, numbers, &onward))
        return false;
    onward.weight = f3_scale(onward.weight, onward.spread * at->share);
    const struct bd_solid_edge edge = bd_solid_edge_at(surfaces, &way->solids, at);
    leave(surfaces, at, &edge, &onward, ray, way);
    way->straight = false; // who is seen looks for nothing through itself
    return true;
}

f3 bd_onward_emission(const struct bd_first_light *light, const struct bd_ray *ray,
                      const struct bd_ray_hit *hit, const struct bd_way *way)
{
    const struct bd_area_lights *lights = light->lights;
    const f3 d = f3_of(ray->direction[0], ray->direction[1], ray->direction[2]);
    const float unit = (float)(1 / light->space->unit_cd_m2);
    f3 radiance = f3_of(0, 0, 0);
    if (!lights) return radiance;
    if (hit->triangle == BD_NO_TRIANGLE) {
        if (lights->sky.shines) radiance = bd_sky_light_radiance(&lights->sky, d);
    } else {
        const struct bd_area_light *at = bd_area_light_at(lights, hit->triangle, hit->u, hit->v);
        if (at) radiance = bd_area_emission(lights, at, hit->u, hit->v, f3_scale(d, -1));
    }
    return f3_mul(way->weight, f3_scale(radiance, unit));
}
