// Sides of points that send light by a lobe, all but of what returns next to nothing: straight
// light that comes to each, of four directions at most, goes on to whoever looks by the whole BRDF.
// Evenly sent, as by others, a wall of brushed metal would light all of a room and not what it
// reflects to, and plastic under grazing light what it turns away from.
//
// A side's lobe is no narrower than patch_roughness; what is a mirror or glass in part sends by the
// rest of it (lights/interface.h). What comes from further directions, and what other surfaces
// bring, is told evenly.
//
// Maletz, Wang, Bowers 2011 (up to four lobes, algorithms.md A4). Thread: made by one; sides are
// told by any, each once; then read by all.

#ifndef BD_LIGHTS_POINT_LOBES_H
#define BD_LIGHTS_POINT_LOBES_H

#include "lights/surface_hits.h"
#include "shared/projected_points.h"

struct bd_point_lobes {
    uint32_t count;    // of sides that have one
    uint32_t *of_side; // the place below, or BD_NO_LOBE; NULL where no side has one
    struct bd_sending_point *sending;
};

// Light that comes to a place.
struct bd_first_way {
    f3 irradiance, way; // unit, to where it comes from
};

// Of `sides` that are numbers below `side_count`, each of a place. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_point_lobes_init(struct bd_point_lobes *lobes, const struct bd_surface_hits *hits,
                                const struct bd_surface_point *places, const uint32_t *sides,
                                uint32_t place_count, uint32_t side_count,
                                struct bd_err_detail *detail);
void bd_point_lobes_finish(struct bd_point_lobes *lobes);

// Keeps the four strongest of what comes to a side that has a lobe. Returns the irradiance that is
// left to be told evenly: of a side that has none all.
f3 bd_point_lobes_keep(struct bd_point_lobes *lobes, const struct bd_surface_hits *hits,
                       const struct bd_surface_point *place, uint32_t side,
                       const struct bd_first_way *ways, uint32_t count);

// Radiance to a viewer, unit: of a side without lobes 0.
f3 bd_point_lobes_send(const struct bd_point_lobes *lobes, uint32_t side, f3 to_viewer);
// What of its light goes that way: irradiance.
f3 bd_point_lobes_get(const struct bd_point_lobes *lobes, uint32_t side);

uint64_t bd_point_lobes_bytes(const struct bd_point_lobes *lobes, uint32_t side_count);

#endif
