// Arguments of pass/splat_bound, pass/splat_vpls and pass/splat_fragments.
#ifndef BD_SHARED_SPLAT_H
#define BD_SHARED_SPLAT_H

#include "shared/types.h"

// Bounds that are tried side by side.
#define BD_SPLAT_BOUNDS 64
// VPLs that one work group of the trial walks.
#define BD_SPLAT_TRIAL_VPLS 64

struct bd_splat_trial_args {
    BD_UVEC4 vpls;                       // x = first VPL of the slice, y = VPLs in it
    BD_VEC4 bounds[BD_SPLAT_BOUNDS / 4]; // irradiance, in the frame's light unit
};

struct bd_splat_args {
    BD_UVEC4 vpls;  // x = first VPL of the draw
    BD_VEC4 bounds; // x = irradiance
};

struct bd_splat_fragments_args {
    BD_UVEC4 vpls;    // x = first VPL of the draw, y = 1 if its list is the first
    BD_UVEC4 size_px; // xy = width and height of the target
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_splat_trial_args) == 16 + 4 * BD_SPLAT_BOUNDS, "std140 size");
_Static_assert(sizeof(struct bd_splat_args) == 32, "std140 size");
_Static_assert(sizeof(struct bd_splat_fragments_args) == 32, "std140 size");
#endif

#endif
