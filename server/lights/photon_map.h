// Photons where they landed on surfaces, and how densely: irradiance of light that nothing but a
// path from its lamp finds.
//
// At a place the BD_PHOTONS_NEAR nearest that face alike tell it, by a parabola over the disk that
// holds them: unbiased where their density is even, smooth as far as it is not. What lies off the
// place's plane counts as four times as far.
//
// A k-d tree (lights/point_tree.h). A function of the photons and their order. Cost: 150 ns a
// photon to build, 2 to 5 us a place among photons, less where there are none.
//
// Jensen 1996; Epanechnikov 1969.
//
// Thread: built by one, then read by all.

#ifndef BD_LIGHTS_PHOTON_MAP_H
#define BD_LIGHTS_PHOTON_MAP_H

#include <stdint.h>

#include "base/err.h"
#include "kernel/math.h"

#define BD_PHOTONS_MAX  (UINT32_C(1) << 20)
#define BD_PHOTONS_NEAR 32u

struct bd_photon {
    f3 position, normal; // render space; unit, of the side that it came to
    f3 flux;             // the frame's unit times render units squared
};

struct bd_photon_map;

// Copies them. `reach`: of a place, render units; photons farther off tell nothing of it.
// BD_ERR_NO_MEMORY, or what `pause` returns.
BD_MUST_CHECK
enum bd_err bd_photon_map_create(const struct bd_photon *photons, uint32_t count, float reach,
                                 enum bd_err (*pause)(void *user), void *user,
                                 struct bd_photon_map **out, struct bd_err_detail *detail);
void bd_photon_map_destroy(struct bd_photon_map **map);
uint64_t bd_photon_map_bytes(const struct bd_photon_map *map);

// Irradiance at a place, in the frame's unit. `normal` is unit. Over a disk of at least that
// radius, render units, whatever lies in it: a pixel has all of a focus that is smaller.
f3 bd_photon_map_look(const struct bd_photon_map *map, f3 position, f3 normal, float least);

#endif
