// What stands on disks of photons (lights/disk_sums.h): rays round each, from its middle. Without,
// light would come through walls.
//
// Private to pass/. Cost: BD_DISK_CUTS short rays a disk, and a plane for each that meets
// something.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_DISK_CUTS_H
#define BD_PASS_DISK_CUTS_H

#include "lights/photon_map.h"
#include "lights/surface_hits.h"
#include "pass/visibility.h"

// All zeroes but for what is set at first. Its room grows as it is asked for.
struct bd_disk_cuts {
    const struct bd_visibility_inputs *visibility; // NULL: nobody looks
    const struct bd_surface_hits *surfaces;
    struct bd_ray_counts traced;
    // Its own.
    uint32_t room, ray_count;
    uint32_t *first; // cut of each disk; UINT32_MAX: nobody looked
    struct bd_ray *rays;
    struct bd_ray_hit *met;
    struct bd_disk_cut *cuts;
};

// Of disks on those triangles; nobody looks about those of radius 0. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_disk_cuts_find(const struct bd_pass_context *context, struct bd_disk_cuts *cuts,
                              const struct bd_photon_disk *disks, const uint32_t *triangles,
                              uint32_t count, struct bd_err_detail *detail);
// Of a disk: BD_DISK_CUTS, or NULL.
const struct bd_disk_cut *bd_disk_cuts_of(const struct bd_disk_cuts *cuts, uint32_t disk);
void bd_disk_cuts_finish(struct bd_disk_cuts *cuts);

#endif
