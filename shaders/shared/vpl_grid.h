// Arguments of pass/vpl_grid.
#ifndef BD_SHARED_VPL_GRID_H
#define BD_SHARED_VPL_GRID_H

#include "shared/types.h"

#define BD_VPL_KERNEL_PATCH 0u
#define BD_VPL_KERNEL_DISK  1u
#define BD_VPL_KERNEL_POINT 2u

struct bd_vpl_grid_args {
    BD_UVEC4 grid;  // x = VPLs along a face's side, y = BD_VPL_KERNEL_*, z = 1: one weight layer
                    // serves every face
    BD_UVEC4 slice; // x = first row of VPLs, y = rows of them, z = face
    BD_VEC4 limits; // x = distance, in radii of the patch, below which it is integrated exactly
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_vpl_grid_args) == 48, "std140 size");
#endif

#endif
