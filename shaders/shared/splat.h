// Arguments of pass/splat_bound, pass/splat_vpls and pass/splat_fragments.
#ifndef BD_SHARED_SPLAT_H
#define BD_SHARED_SPLAT_H

#include "shared/types.h"

// Bounds that are tried side by side.
#define BD_SPLAT_BOUNDS 64
// VPLs that one work group of the trial walks.
#define BD_SPLAT_TRIAL_VPLS 64

struct bd_splat_trial_args {
    BD_UINT first_vpl; // of the slice
    BD_UINT vpl_count; // in it
    BD_UINT unused_0;
    BD_UINT unused_1;

    BD_VEC4 bounds[BD_SPLAT_BOUNDS / 4]; // irradiance, in the frame's light unit; four a vector
};

struct bd_splat_args {
    BD_UINT first_vpl; // of the draw
    BD_UINT unused_0;
    BD_UINT unused_1;
    BD_UINT unused_2;

    BD_FLOAT bound; // irradiance, in the frame's light unit
    BD_FLOAT unused_3;
    BD_FLOAT unused_4;
    BD_FLOAT unused_5;
};

struct bd_splat_fragments_args {
    BD_UINT first_vpl;     // of the draw
    BD_UINT is_first_list; // 1: they are of the first list
    BD_UINT unused_0;
    BD_UINT unused_1;

    BD_UVEC4 size_px; // xy = width and height of the target
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_splat_trial_args) == 16 + 4 * BD_SPLAT_BOUNDS, "std140 size");
_Static_assert(sizeof(struct bd_splat_args) == 32, "std140 size");
_Static_assert(sizeof(struct bd_splat_fragments_args) == 32, "std140 size");
#endif

#endif
