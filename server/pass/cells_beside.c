#include "pass/cells_beside.h"

#include <stdlib.h>

#include "lights/irradiance_cells.h"
#include "pass/beside.h"
#include "pass/receivers.h"

// Cells at once, that rays are asked for.
#define AT_ONCE 8192u
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_CELL 200.0
#define SEGMENTS       (2 * BD_CELLS_BESIDE) // of a cell

struct finding {
    struct bd_irradiance_cells *cells;
    uint32_t first, count; // of those that are asked for
    struct bd_segment *segments;
    uint32_t *hidden;
};

static uint32_t *beside(const struct bd_irradiance_cells *cells, uint32_t cell)
{
    return &cells->beside[(size_t)BD_CELLS_BESIDE * cell];
}

static struct bd_beside_place place_of(const struct bd_irradiance_cells *cells, uint32_t cell)
{
    return (struct bd_beside_place){cells->places[cell].position, cells->places[cell].normal};
}

static void search(const struct bd_irradiance_cells *cells, uint32_t cell)
{
    const struct bd_cell_place *at = &cells->places[cell];
    uint32_t about[BD_CELLS_ABOUT_MOST], found = 0;
    const uint32_t count =
        bd_irradiance_cells_about(cells, at->position, at->normal, about, BD_CELLS_ABOUT_MOST);
    for (uint32_t i = 0; i < count && found < BD_CELLS_BESIDE; i++)
        if (about[i] != cell) beside(cells, cell)[found++] = about[i];
    while (found < BD_CELLS_BESIDE) beside(cells, cell)[found++] = BD_NO_CELL;
}

// Where there is no other cell, ways of no length.
static void aim(const struct finding *f, uint32_t i)
{
    const uint32_t cell = f->first + i;
    const struct bd_beside_place from = place_of(f->cells, cell);
    search(f->cells, cell);
    for (uint32_t k = 0; k < BD_CELLS_BESIDE; k++) {
        const uint32_t other = beside(f->cells, cell)[k];
        const struct bd_beside_place to = other == BD_NO_CELL ? from : place_of(f->cells, other);
        bd_way_beside(&f->segments[SEGMENTS * (size_t)i + 2 * k], &from, &to);
    }
}

static void aim_group(void *user, uint32_t group)
{
    const struct finding *f = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES && i < f->count; i++) aim(f, i);
}

static bool is_hidden(const struct finding *f, size_t segment)
{
    return f->hidden[segment / 32] >> segment % 32 & 1;
}

static void keep_seen(const struct finding *f, uint32_t i)
{
    uint32_t *of_cell = beside(f->cells, f->first + i), kept = 0;
    for (uint32_t k = 0; k < BD_CELLS_BESIDE && of_cell[k] != BD_NO_CELL; k++) {
        const size_t way = SEGMENTS * (size_t)i + 2 * k;
        if (!is_hidden(f, way) && !is_hidden(f, way + 1)) of_cell[kept++] = of_cell[k];
    }
    while (kept < BD_CELLS_BESIDE) of_cell[kept++] = BD_NO_CELL;
}

static enum bd_err find_some(const struct bd_pass_context *context,
                             const struct bd_visibility_inputs *visibility, struct finding *f,
                             struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    bd_slicer_work(context->slicer, "cells beside");
    enum bd_err err = bd_receivers_each(context, (f->count + BD_LANES - 1) / BD_LANES,
                                        UNITS_PER_CELL * BD_LANES, aim_group, f);
    if (!err)
        err = bd_visibility_ask(context, visibility, f->segments, SEGMENTS * (size_t)f->count,
                                f->hidden, traced, detail);
    for (uint32_t i = 0; !err && i < f->count; i++) keep_seen(f, i);
    return err;
}

enum bd_err bd_cells_beside_find(const struct bd_pass_context *context,
                                 const struct bd_visibility_inputs *visibility,
                                 struct bd_irradiance_cells *cells, struct bd_ray_counts *traced,
                                 struct bd_err_detail *detail)
{
    const uint32_t at_once = cells->count < AT_ONCE ? cells->count : AT_ONCE;
    const size_t segments = SEGMENTS * ((size_t)at_once + 1);
    struct finding f = {.cells = cells,
                        .segments = malloc(segments * sizeof *f.segments),
                        .hidden = malloc((segments / 32 + 1) * sizeof *f.hidden)};
    cells->beside = malloc(BD_CELLS_BESIDE * ((size_t)cells->count + 1) * sizeof *cells->beside);
    enum bd_err err = BD_ERR_OK;
    if (!f.segments || !f.hidden || !cells->beside)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "cache_cells", "no memory for %u", cells->count);
    for (; !err && f.first < cells->count; f.first += f.count) {
        const uint32_t left = cells->count - f.first;
        f.count = left < at_once ? left : at_once;
        err = find_some(context, visibility, &f, traced, detail);
    }
    free(f.segments);
    free(f.hidden);
    return err;
}
