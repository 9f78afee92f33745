// What a map of photons tells of places where rays end: the irradiance of photons about each that
// no wall stands between (pass/disk_cuts.h).
//
// Private to pass/. Cost: 2 to 40 us a place among photons (lights/photon_map.h), and its disk's
// rays.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_PHOTON_PLACES_H
#define BD_PASS_PHOTON_PLACES_H

#include "pass/disk_cuts.h"

struct bd_photon_places_inputs {
    const struct bd_photon_map *map;
    const struct bd_visibility_inputs *visibility;
    const struct bd_surface_hits *surfaces;
    float least; // of disks' radius, render units
    const struct bd_surface_point *places;
    uint32_t count;
};

// Adds it to `irradiance`, in slices. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_photon_places_add(const struct bd_pass_context *context,
                                 const struct bd_photon_places_inputs *inputs, f3 *irradiance,
                                 struct bd_ray_counts *traced, struct bd_err_detail *detail);

#endif
