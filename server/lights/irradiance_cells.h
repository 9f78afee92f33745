// A cache of irradiance over the places that rays met: cells of space, and of the ways that
// surfaces face, each with as many of those places as any other, so that it is fine where many rays
// go. A cell is told the light of one of its places, chosen by its number and not by who came
// first, and tells it to all.
//
// Cells are those of a grid over render space, halved as often as it takes: their numbers do not
// depend on a camera.
//
// Ward, Rubinstein, Clear 1988 (caching irradiance); Binder, Fricke, Keller 2018 (in cells of
// space).
//
// Thread: made by one, then read by all.

#ifndef BD_LIGHTS_IRRADIANCE_CELLS_H
#define BD_LIGHTS_IRRADIANCE_CELLS_H

#include <stdint.h>

#include "base/err.h"
#include "kernel/math.h"

// Number of the smallest cell about a place with that unit normal: the face that the normal leaves
// by, then a Morton code. `radius` is the render space's.
uint64_t bd_irradiance_cell_at(f3 position, f3 normal, float radius);

// That stands for a cell, and whose light it tells.
struct bd_cell_place {
    f3 position, normal; // render space, unit
};

struct bd_irradiance_cells {
    uint32_t count;
    float radius;
    uint64_t *first, *beyond; // of each the least number that is in it, and behind it; they ascend
    uint32_t *chosen; // which of the places stands for it
    struct bd_cell_place *places; // that, once whoever has the places says so
    uint32_t *number; // that cells keep whatever becomes of others, and neighbours differ in
    f3 *irradiance;   // that it tells
    // BD_CELLS_BESIDE of each, that its place sees, then BD_NO_CELL; NULL: nobody has looked.
    uint32_t *beside;
};
#define BD_NO_CELL      UINT32_MAX
#define BD_CELLS_BESIDE 7u

// Over places with those numbers, which are put in order; of at most `most` cells, from 6 on.
// Irradiance is 0 at first. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_irradiance_cells_create(const uint64_t *numbers, uint32_t place_count, uint32_t most,
                                       float radius, struct bd_irradiance_cells **out,
                                       struct bd_err_detail *detail);
void bd_irradiance_cells_destroy(struct bd_irradiance_cells **cells);
uint64_t bd_irradiance_cells_bytes(const struct bd_irradiance_cells *cells);

// The cell that a place lies in, or where there is none, one there of surfaces that face next to as
// it does; BD_NO_CELL: none of any, for no place was there.
uint32_t bd_irradiance_cells_find(const struct bd_irradiance_cells *cells, f3 position, f3 normal);

// The cell that a place lies in, if its own place faces as that does; or BD_NO_CELL.
uint32_t bd_irradiance_cells_of(const struct bd_irradiance_cells *cells, f3 position, f3 normal);

// Cells that may stand for a place, whose own places face as it does: the one that it lies in, then
// those about that, the nearest first; where no such cell is about, one that is not far. At most
// `most`, 1 to BD_CELLS_ABOUT_MOST; how many.
#define BD_CELLS_ABOUT_MOST 8u
uint32_t bd_irradiance_cells_about(const struct bd_irradiance_cells *cells, f3 position, f3 normal,
                                   uint32_t *about, uint32_t most);

// Irradiance at a place that sees that cell's place: the mean of the cell and of those beside it,
// weighed by inverse distances up to a reach (Franke and Nielson 1980), so that mirrors show no
// cells.
f3 bd_irradiance_cells_between(const struct bd_irradiance_cells *cells, uint32_t cell, f3 position,
                               f3 normal);

#endif
