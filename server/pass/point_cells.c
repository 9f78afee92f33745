#include "pass/point_cells.h"

#include <stdlib.h>

#include "kernel/all_channels.h"
#include "lights/sequence.h"
#include "lights/surface_hits.h"
#include "pass/cells_of_sides.h"
#include "pass/point_sights.h"
#include "pass/receivers.h"

// Of a side: what comes to it is seen in the mean over many.
#define RAYS_OF_SIDE 4u
// In the mean. Of fewer there would be noise, of more light would be spread far about.
#define SIDES_OF_CELL 4u
#define CELLS_LEAST   64u
// As printed, for each looks at a thousand points.
#define CELLS_BY_MAPS 8192u
// Light goes on while a round changes what comes to places, together, by more than that part of it.
#define CHANGE_LEAST 1e-3
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_SIDE 1.0

struct cells {
    struct bd_pass_context context;
    const struct bd_point_cells_inputs *inputs;
    struct bd_irradiance_cells *cells;
    uint32_t *cell_of;               // each side's, or BD_NO_CELL
    uint32_t *members;               // how many of those of each cell
    struct bd_surface_point *places; // who look: sides, or the places that stand for cells
    struct bd_point_sights sights;   // of theirs
    f3 *own, *before;                // irradiance of those who look, and in the round before
    f3 *radiance;
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

static f3 sent(const struct bd_point_sides *sides, uint32_t side, f3 irradiance)
{
    return f3_scale(f3_mul(irradiance, sides->places[side].diffuse), 1 / F_PI);
}

struct sending {
    const struct bd_point_sides *sides;
    f3 *radiance;
};

static void send_first(void *user, uint32_t group)
{
    const struct sending *s = user;
    for (uint32_t i = group * BD_LANES; i < end_of_group(group, s->sides->count); i++)
        s->radiance[s->sides->radiance_of[i]] = sent(s->sides, i, s->sides->first[i]);
}

enum bd_err bd_points_send_first(const struct bd_pass_context *context,
                                 const struct bd_point_sides *sides, f3 *radiance)
{
    struct sending sending = {sides, radiance};
    bd_slicer_work(context->slicer, "points send");
    return bd_receivers_each(context, groups_of(sides->count), UNITS_PER_SIDE * BD_LANES,
                             send_first, &sending);
}

// By its cell; those alone know what they get themselves.
static f3 told_to(const struct cells *c, uint32_t side)
{
    const uint32_t cell = c->cell_of[side];
    if (cell != BD_NO_CELL) return c->cells->irradiance[cell];
    return c->inputs->projected ? f3_of(0, 0, 0) : c->own[side];
}

static void send_all(void *user, uint32_t group)
{
    const struct cells *c = user;
    const struct bd_point_sides *sides = c->inputs->sides;
    for (uint32_t i = group * BD_LANES; i < end_of_group(group, sides->count); i++)
        c->radiance[sides->radiance_of[i]] = sent(sides, i, f3_add(sides->first[i], told_to(c, i)));
}

static enum bd_err send_on(struct cells *c)
{
    bd_slicer_work(c->context.slicer, "points send");
    return bd_receivers_each(&c->context, groups_of(c->inputs->sides->count),
                             UNITS_PER_SIDE * BD_LANES, send_all, c);
}

// --- cells --------------------------------------------------------------------------------------

// Of sides to which light comes, by `own`; NULL: of all. What light does not reach has none.
static enum bd_err make_cells(struct cells *c, const f3 *own, uint32_t *of)
{
    const struct bd_point_sides *sides = c->inputs->sides;
    const float radius = (float)c->inputs->space->radius;
    uint64_t *numbers = malloc((sides->count + 1) * sizeof *numbers);
    uint32_t count = 0;
    if (!numbers) return no_memory(c);
    for (uint32_t i = 0; i < sides->count; i++) {
        if (own && all_channels(own[i]) <= 0) continue;
        numbers[count] =
            bd_irradiance_cell_at(sides->places[i].position, sides->places[i].normal, radius);
        of[count++] = i;
    }
    uint32_t most = count / SIDES_OF_CELL + CELLS_LEAST;
    if (most > c->inputs->cells) most = c->inputs->cells;
    if (c->inputs->projected && most > CELLS_BY_MAPS) most = CELLS_BY_MAPS;
    const enum bd_err err =
        bd_irradiance_cells_create(numbers, count, most, radius, &c->cells, c->detail);
    for (uint32_t i = 0; !err && i < c->cells->count; i++) {
        const struct bd_surface_point *place = &sides->places[of[c->cells->chosen[i]]];
        c->cells->chosen[i] = of[c->cells->chosen[i]];
        c->cells->places[i] = (struct bd_cell_place){place->position, place->normal};
    }
    free(numbers);
    return err;
}

static enum bd_err join_cells(struct cells *c, struct bd_ray_counts *traced)
{
    const struct bd_point_sides *sides = c->inputs->sides;
    c->members = calloc(c->cells->count + 1, sizeof *c->members);
    if (!c->members) return no_memory(c);
    const enum bd_err err =
        bd_cells_of_sides(&c->context, c->inputs, c->cells, c->cell_of, traced, c->detail);
    for (uint32_t i = 0; !err && i < sides->count; i++)
        if (c->cell_of[i] != BD_NO_CELL) c->members[c->cell_of[i]]++;
    return err;
}

static enum bd_err make_room(struct cells *c)
{
    const size_t sides = c->inputs->sides->count + 1;
    c->cell_of = malloc(sides * sizeof *c->cell_of);
    c->places = malloc(sides * sizeof *c->places);
    c->own = calloc(sides, sizeof *c->own);
    c->before = calloc(sides, sizeof *c->before);
    return c->cell_of && c->places && c->own && c->before ? BD_ERR_OK : no_memory(c);
}

// --- by rays ------------------------------------------------------------------------------------

// A point's two sides draw differently.
static void name_sides(struct cells *c)
{
    const struct bd_point_sides *sides = c->inputs->sides;
    for (uint32_t i = 0; i < sides->count; i++) {
        const uint32_t number = sides->radiance_of[i];
        c->places[i] = sides->places[i];
        c->places[i].number = bd_stirred(c->inputs->points->names[number / 2]) + number % 2;
    }
}

static enum bd_err get(struct cells *c)
{
    return bd_point_sights_sum(&c->context, &c->sights, c->radiance, c->own);
}

static enum bd_err look_by_rays(struct cells *c, struct bd_ray_counts *traced)
{
    name_sides(c);
    enum bd_err err =
        bd_point_sights_by_rays(&c->context, c->inputs, c->places, c->inputs->sides->count,
                                RAYS_OF_SIDE, &c->sights, traced, c->detail);
    if (!err) err = get(c);
    if (!err) err = make_cells(c, c->own, c->cell_of);
    return err ? err : join_cells(c, traced);
}

// A cell tells the mean of what its sides get.
static void tell_means(struct cells *c)
{
    f3 *irradiance = c->cells->irradiance;
    for (uint32_t i = 0; i < c->cells->count; i++) irradiance[i] = f3_of(0, 0, 0);
    for (uint32_t i = 0; i < c->inputs->sides->count; i++) {
        const uint32_t cell = c->cell_of[i];
        if (cell == BD_NO_CELL) continue;
        const float part = 1 / (float)c->members[cell];
        irradiance[cell] = f3_add(irradiance[cell], f3_scale(c->own[i], part));
    }
}

// --- by maps ------------------------------------------------------------------------------------

static enum bd_err look_by_maps(struct cells *c, struct bd_ray_counts *traced)
{
    enum bd_err err = make_cells(c, NULL, c->cell_of);
    for (uint32_t i = 0; !err && i < c->cells->count; i++) {
        c->places[i] = c->inputs->sides->places[c->cells->chosen[i]];
        c->places[i].number = c->cells->number[i];
    }
    if (!err) err = join_cells(c, traced);
    return err ? err
               : bd_point_sights_by_maps(&c->context, c->inputs, c->places, c->cells->count,
                                         &c->sights, c->detail);
}

static void tell_own(struct cells *c)
{
    for (uint32_t i = 0; i < c->cells->count; i++) c->cells->irradiance[i] = c->own[i];
}

// --- rounds -------------------------------------------------------------------------------------

// Whether the last round changed enough; keeps what it made.
static bool goes_on(const struct cells *c)
{
    double changed = 0, all = 0;
    for (uint32_t i = 0; i < c->sights.count; i++) {
        changed += all_channels(f3_abs(f3_sub(c->own[i], c->before[i])));
        all += all_channels(c->own[i]);
        c->before[i] = c->own[i];
    }
    return changed > CHANGE_LEAST * all;
}

static enum bd_err go_round(struct cells *c, uint32_t *rounds)
{
    enum bd_err err = BD_ERR_OK;
    for (bool is_on = true; !err && is_on && *rounds < c->inputs->rounds; ++*rounds) {
        err = get(c);
        if (c->inputs->projected)
            tell_own(c);
        else
            tell_means(c);
        if (!err) err = send_on(c);
        is_on = goes_on(c);
    }
    return err;
}

enum bd_err bd_point_cells_run(const struct bd_pass_context *context,
                               const struct bd_point_cells_inputs *inputs, f3 *radiance,
                               struct bd_irradiance_cells **out, uint32_t *rounds,
                               struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    struct cells c = {
        .context = *context, .inputs = inputs, .radiance = radiance, .detail = detail};
    enum bd_err err = make_room(&c);
    if (!err) err = inputs->projected ? look_by_maps(&c, traced) : look_by_rays(&c, traced);
    if (!err) err = go_round(&c, rounds);
    bd_point_sights_finish(&c.sights);
    free(c.cell_of);
    free(c.members);
    free(c.places);
    free(c.own);
    free(c.before);
    if (err) bd_irradiance_cells_destroy(&c.cells);
    *out = c.cells;
    return err;
}
