// Irradiance by photons in cells of space (lights/irradiance_cells.h), for rays that end among
// them: each cell is told at one photon's place, walls and all (pass/photon_places.h), once for
// however many rays look (pass/beside.h).
//
// Christensen 1999 (irradiance at photons, before anybody looks). Private to pass/.
// Cost: some 20 us of one core a cell.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_PHOTON_CELLS_H
#define BD_PASS_PHOTON_CELLS_H

#include "lights/irradiance_cells.h"
#include "lights/photon_map.h"
#include "lights/surface_hits.h"
#include "pass/visibility.h"

struct bd_photon_cells_inputs {
    const struct bd_photon *photons; // where they landed
    uint32_t count;
    const struct bd_photon_map *map; // of all of them
    const struct bd_visibility_inputs *visibility;
    const struct bd_surface_hits *surfaces;
};

// BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_photon_cells_run(const struct bd_pass_context *context,
                                const struct bd_photon_cells_inputs *inputs,
                                struct bd_irradiance_cells **out, struct bd_err_detail *detail);

#endif
