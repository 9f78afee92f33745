#include "pass/cells_of_sides.h"

#include <stdlib.h>

#include "pass/beside.h"
#include "pass/receivers.h"

// Sides that ask at once.
#define AT_ONCE 65536u
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_SIDE 2.0

struct asking {
    const struct bd_point_cells_inputs *inputs;
    const struct bd_irradiance_cells *cells;
    uint32_t first, count; // of sides that ask now
    uint32_t *cell_of;
    struct bd_segment *segments; // two for each
    uint32_t *hidden;
};

static struct bd_beside_place beside_of(const struct bd_surface_point *at)
{
    return (struct bd_beside_place){.position = at->position, .normal = at->normal};
}

// Who lies in no cell, or whose cell is of others, asks by segments of no length.
static void ask(const struct asking *a, uint32_t k)
{
    const uint32_t side = a->first + k;
    const struct bd_surface_point *at = &a->inputs->sides->places[side];
    const uint32_t cell = bd_irradiance_cells_of(a->cells, at->position, at->normal);
    const struct bd_surface_point *place =
        cell == BD_NO_CELL ? at : &a->inputs->sides->places[a->cells->chosen[cell]];
    const struct bd_beside_place from = beside_of(at), to = beside_of(place);
    bd_way_beside(&a->segments[2 * (size_t)k], &from, &to);
    a->cell_of[side] = cell;
}

static void ask_group(void *user, uint32_t group)
{
    const struct asking *a = user;
    for (uint32_t k = group * BD_LANES; k < (group + 1) * BD_LANES && k < a->count; k++) ask(a, k);
}

static enum bd_err ask_some(const struct bd_pass_context *context, struct asking *a,
                            struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    bd_slicer_work(context->slicer, "cells of sides");
    enum bd_err err = bd_receivers_each(context, (a->count + BD_LANES - 1) / BD_LANES,
                                        UNITS_PER_SIDE * BD_LANES, ask_group, a);
    if (err || a->inputs->projected) return err;
    err = bd_visibility_ask(context, a->inputs->visibility, a->segments, 2 * (size_t)a->count,
                            a->hidden, traced, detail);
    for (uint32_t k = 0; !err && k < a->count; k++)
        if (a->hidden[k / 16] >> 2 * (k % 16) & 3) a->cell_of[a->first + k] = BD_NO_CELL;
    return err;
}

enum bd_err bd_cells_of_sides(const struct bd_pass_context *context,
                              const struct bd_point_cells_inputs *inputs,
                              const struct bd_irradiance_cells *cells, uint32_t *cell_of,
                              struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    const uint32_t sides = inputs->sides->count;
    struct asking a = {.inputs = inputs,
                       .cells = cells,
                       .cell_of = cell_of,
                       .segments = malloc(2 * AT_ONCE * sizeof *a.segments),
                       .hidden = malloc(2 * AT_ONCE / 32 * sizeof *a.hidden)};
    enum bd_err err = BD_ERR_OK;
    if (!a.segments || !a.hidden)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "points", "no memory for cells of sides");
    for (; !err && a.first < sides; a.first += a.count) {
        a.count = sides - a.first < AT_ONCE ? sides - a.first : AT_ONCE;
        err = ask_some(context, &a, traced, detail);
    }
    free(a.segments);
    free(a.hidden);
    return err;
}
