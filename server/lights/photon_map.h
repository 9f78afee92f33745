// Photons where they landed on surfaces, and how densely: irradiance of light that nothing but a
// path from its lamp finds.
//
// At a place those nearest that face alike tell it, by a parabola over the disk that holds them:
// unbiased where their density is even, smooth as far as it is not. What lies off the place's plane
// counts as eight times as far. How large the disk is BD_PHOTONS_NEAR of them tell; it shrinks
// where it then holds too many, of a brighter place farther off.
//
// Of a disk that reaches past a surface's edge, or over a bend, that part counts which points of
// all surfaces say is there: else edges are half as bright, and corners a quarter.
//
// A k-d tree (lights/point_tree.h) and sums over its parts (lights/disk_sums.h). A function of the
// photons and their order. Cost: 460 ns a photon to build; a place among photons 2 us, over a disk
// of 16,000 of them 40; less where there are none.
//
// Jensen 1996; Epanechnikov 1969; Silverman 1986 (a pilot's density); algorithms.md A5.6 P4.
//
// Thread: built by one, then read by all.

#ifndef BD_LIGHTS_PHOTON_MAP_H
#define BD_LIGHTS_PHOTON_MAP_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "kernel/math.h"
#include "lights/disk_sums.h"
#include "lights/surface_points.h"

#define BD_PHOTONS_MAX        (UINT32_C(1) << 20) // that are sent
#define BD_PHOTONS_LANDED_MAX (UINT32_C(1) << 21) // some several times
#define BD_PHOTONS_NEAR       32u

struct bd_photon {
    f3 position, normal; // render space; unit, of the side that it came to
    f3 flux;             // the frame's unit times render units squared
    f3 way;              // unit, to where it came from
    bool is_met;         // rays from a receiver meet its lamp, too
    bool
        is_by_brushed; // its last wall was brushed metal, where lobes look for its light themselves
};

struct bd_photon_map;

struct bd_photon_map_how {
    float reach;   // of a place, render units; photons farther off tell nothing of it
    uint32_t near; // that its disk holds, about; fewer than BD_PHOTONS_NEAR are those
    float radius;  // of all disks, render units, instead; 0: as above
    const struct bd_surface_points *surfaces; // all of them. NULL: every disk is whole
};

// Copies them. BD_ERR_NO_MEMORY, or what `pause` returns.
BD_MUST_CHECK
enum bd_err bd_photon_map_create(const struct bd_photon *photons, uint32_t count,
                                 const struct bd_photon_map_how *how,
                                 enum bd_err (*pause)(void *user), void *user,
                                 struct bd_photon_map **out, struct bd_err_detail *detail);
void bd_photon_map_destroy(struct bd_photon_map **map);
uint64_t bd_photon_map_bytes(const struct bd_photon_map *map);

// About a place.
struct bd_photon_disk {
    f3 position, normal; // unit
    float radius;        // render units; 0: no photon is near
};
// Of at least that radius, whatever lies in it: a pixel has all of a focus that is smaller.
struct bd_photon_disk bd_photon_disk_of(const struct bd_photon_map *map, f3 position, f3 normal,
                                        float least);

// Irradiance at a disk's middle, in the frame's unit. `cuts`: BD_DISK_CUTS, or NULL: nothing
// stands there. `vector`, or NULL: the irradiance vector, of all channels together, whose dot
// product with the disk's normal is the sum of the irradiance's.
f3 bd_photon_map_tell(const struct bd_photon_map *map, const struct bd_photon_disk *disk,
                      const struct bd_disk_cut *cuts, f3 *vector);

// One of those on a disk: what it adds to the irradiance, and whence.
struct bd_photon_told {
    f3 irradiance, way;
    bool is_met, is_by_brushed;
};
// For lobes, which sums tell nothing of.
void bd_photon_map_each(const struct bd_photon_map *map, const struct bd_photon_disk *disk,
                        const struct bd_disk_cut *cuts,
                        void (*look)(void *user, const struct bd_photon_told *told), void *user);

// The same of a place where nobody has looked what stands there.
f3 bd_photon_map_look(const struct bd_photon_map *map, f3 position, f3 normal, float least);
#endif
