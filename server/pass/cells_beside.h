// Which cells of a cache (lights/irradiance_cells.h) lie beside which, as far as their places see
// each other: mirrors and glass show what lies between them.
//
// Private to pass/. Cost: a search and some seven short segments a cell, of bent surfaces twice as
// many.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_CELLS_BESIDE_H
#define BD_PASS_CELLS_BESIDE_H

#include "pass/visibility.h"

struct bd_irradiance_cells;

// Fills `beside`. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_cells_beside_find(const struct bd_pass_context *context,
                                 const struct bd_visibility_inputs *visibility,
                                 struct bd_irradiance_cells *cells, struct bd_ray_counts *traced,
                                 struct bd_err_detail *detail);

#endif
