#include "pass/point_walk.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "kernel/all_channels.h"
#include "lights/directions.h"
#include "lights/sequence.h"
#include "pass/nearest.h"

// How many walk for each cell, and how often they go on.
#define WALKS_PER_CELL 8u
#define WALKS_MOST     262144u
#define STEPS          5u
// Regions, by the upper bits of cells' numbers: of the ways to face, and five of each axis.
#define REGION_SHIFT 45u
#define REGIONS      (6u << 15)
// That go on from each region, about.
#define OF_REGION 64
// Numbers that nobody else of a frame draws by its seed.
#define OF_WALK 0x77616c6bu

static uint32_t walks_of(const struct bd_point_walk *w)
{
    const uint32_t wanted = WALKS_PER_CELL * w->inputs->cells;
    return wanted < WALKS_MOST ? wanted : WALKS_MOST;
}

static enum bd_err make_room(struct bd_point_walk *w, struct bd_err_detail *detail)
{
    const size_t walks = walks_of(w), sides = w->inputs->sides->count;
    const size_t most = (walks > sides ? walks : sides) + 1;
    w->places = malloc((walks * STEPS + sides + 1) * sizeof *w->places);
    w->starts = malloc(most * sizeof *w->starts);
    w->rays = malloc(most * sizeof *w->rays);
    w->met = malloc(most * sizeof *w->met);
    if (w->places && w->starts && w->rays && w->met) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "points", "no memory to walk between %zu sides",
                      sides);
}

void bd_point_walk_finish(struct bd_point_walk *w)
{
    free(w->places);
    free(w->starts);
    free(w->rays);
    free(w->met);
}

// --- where it starts ----------------------------------------------------------------------------

f3 bd_point_side_sends(const struct bd_point_sides *sides, uint32_t side, f3 irradiance)
{
    return f3_scale(f3_mul(irradiance, sides->places[side].diffuse), 1 / F_PI);
}

// In the mean over all directions.
static double sent_to_all(const struct bd_point_walk *w, uint32_t i)
{
    const struct bd_point_sides *sides = w->inputs->sides;
    const f3 of_lobe = bd_point_lobes_get(sides->lobes, sides->radiance_of[i]);
    return (double)all_channels(
        f3_add(w->radiance[sides->radiance_of[i]], bd_point_side_sends(sides, i, of_lobe)));
}

// Of all, in even steps through what they send.
static uint32_t start(const struct bd_point_walk *w)
{
    const struct bd_point_sides *sides = w->inputs->sides;
    const uint32_t most = walks_of(w);
    double sum = 0, passed = 0;
    uint32_t count = 0;
    for (uint32_t i = 0; i < sides->count; i++) sum += sent_to_all(w, i);
    for (uint32_t i = 0; sum > 0 && i < sides->count; i++) {
        passed += sent_to_all(w, i);
        for (; count < most && (count + 0.5) * sum < passed * most; count++) {
            w->starts[count] = sides->places[i];
            w->starts[count].number = count;
        }
    }
    return count;
}

// --- steps --------------------------------------------------------------------------------------

static enum bd_err look(const struct bd_pass_context *context, struct bd_point_walk *w,
                        uint32_t count, uint32_t step, struct bd_ray_counts *traced,
                        struct bd_err_detail *detail)
{
    const struct bd_sequence sequence = bd_sequence_of((uint32_t)w->inputs->seed, OF_WALK + step);
    for (uint32_t i = 0; i < count; i++) {
        const struct bd_surface_point *at = &w->starts[i];
        float number[2];
        bd_sequence_pair(&sequence, at->number, number);
        const struct bd_basis basis = bd_basis_of(at->normal);
        const f3 d = bd_from_basis(&basis, at->normal, bd_cosine_direction(number));
        w->rays[i] = (struct bd_ray){
            .origin = {at->position.x, at->position.y, at->position.z},
            .from_triangle = at->triangle,
            .direction = {d.x, d.y, d.z},
            .far = INFINITY,
        };
    }
    return bd_nearest_ask(context, w->inputs->visibility, w->rays, count, w->met, traced, detail);
}

enum bd_err bd_point_walk_look(const struct bd_pass_context *context, struct bd_point_walk *w,
                               uint32_t count, struct bd_ray_counts *traced,
                               struct bd_err_detail *detail)
{
    return look(context, w, count, STEPS, traced, detail);
}

bool bd_point_walk_sees(const struct bd_point_walk *w, uint32_t i, struct bd_surface_point *seen)
{
    const struct bd_ray_hit *hit = &w->met[i];
    const float *d = w->rays[i].direction;
    if (hit->triangle == BD_NO_TRIANGLE) return false;
    return bd_surface_hit_at(w->hits, hit->triangle, hit->u, hit->v, f3_of(d[0], d[1], d[2]), seen);
}

// Adds where those are that come somewhere; how many.
static uint32_t land(struct bd_point_walk *w, uint32_t count)
{
    const uint32_t before = w->count;
    for (uint32_t i = 0; i < count; i++)
        if (bd_point_walk_sees(w, i, &w->places[w->count]))
            w->places[w->count++].number = bd_stirred(w->starts[i].number + 1);
    return w->count - before;
}

// A part of space and of the ways that surfaces face.
static uint32_t region_of(const struct bd_point_walk *w, const struct bd_surface_point *at)
{
    const float radius = (float)w->inputs->space->radius;
    return (uint32_t)(bd_irradiance_cell_at(at->position, at->normal, radius) >> REGION_SHIFT);
}

// The last that landed start again, of each region about as many as of any other, by their own
// numbers: light that few found goes on as well as that of many, and what one of them does is
// nothing to those elsewhere.
static uint32_t go_on(struct bd_point_walk *w, uint32_t count)
{
    const struct bd_surface_point *landed = w->places + w->count - count;
    uint32_t *arrived = calloc(REGIONS, sizeof *arrived);
    uint32_t kept = 0;
    BD_ASSERT(arrived);
    for (uint32_t i = 0; i < count; i++) arrived[region_of(w, &landed[i])]++;
    for (uint32_t i = 0; i < count; i++) {
        const double drawn = bd_stirred(landed[i].number) * 0x1p-32;
        if (drawn * arrived[region_of(w, &landed[i])] < OF_REGION) w->starts[kept++] = landed[i];
    }
    free(arrived);
    return kept;
}

// Each step goes on from where the one before came to.
enum bd_err bd_point_walk_run(const struct bd_pass_context *context, struct bd_point_walk *w,
                              struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    enum bd_err err = make_room(w, detail);
    uint32_t count = err ? 0 : start(w);
    for (uint32_t step = 0; !err && step < STEPS; step++) {
        err = look(context, w, count, step, traced, detail);
        if (!err) count = go_on(w, land(w, count));
    }
    return err;
}
