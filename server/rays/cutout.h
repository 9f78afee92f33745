// Where a triangle that is not opaque is there: its material's alpha at a point, filtered as a GPU
// filters level 0. Private to rays/.
//
// Thread: made on one, then read by all.

#ifndef BD_RAYS_CUTOUT_H
#define BD_RAYS_CUTOUT_H

#include "rays/rays.h"

// Alpha in [0, 1] of a triangle of the primitive, at barycentrics of its second and third corner.
float bd_cutout_alpha(const struct bd_scene *scene, const struct bd_primitive *primitive,
                      uint32_t triangle, float u, float v);

#endif
