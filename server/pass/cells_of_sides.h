// Which cell (lights/irradiance_cells.h) tells each side of a point the light that goes round
// (pass/point_cells.h): the one that it lies in, if it sees the place that stands for that. A cell
// may reach through a wall, or be of several things among each other: sides that do not see its
// place are alone. As printed none looks, and those alone lie in no cell.
//
// Private to pass/. Cost: a short segment a side, of bent surfaces two.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_CELLS_OF_SIDES_H
#define BD_PASS_CELLS_OF_SIDES_H

#include "pass/point_cells.h"

// Sides stand for cells. `cell_of`: of each side its cell, BD_NO_CELL of those alone.
// BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_cells_of_sides(const struct bd_pass_context *context,
                              const struct bd_point_cells_inputs *inputs,
                              const struct bd_irradiance_cells *cells, uint32_t *cell_of,
                              struct bd_ray_counts *traced, struct bd_err_detail *detail);

#endif
