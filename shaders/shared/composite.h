// Arguments of pass/composite.
#ifndef BD_SHARED_COMPOSITE_H
#define BD_SHARED_COMPOSITE_H

#include "shared/types.h"

// The layer that a run of the pass writes; the order of enum bd_layer (frame/request.h).
#define BD_COMPOSITE_BEAUTY   0
#define BD_COMPOSITE_DIRECT   1
#define BD_COMPOSITE_INDIRECT 2
#define BD_COMPOSITE_EMISSION 3
#define BD_COMPOSITE_ALBEDO   4
#define BD_COMPOSITE_NORMAL   5
#define BD_COMPOSITE_DEPTH    6
#define BD_COMPOSITE_NOISE    7
#define BD_COMPOSITE_BLUR     8

struct bd_composite_args {
    BD_FLOAT sub_frame_weight; // 1 / sub-frames (finish)
    BD_FLOAT unit_cd_m2;       // the frame's light unit
    BD_FLOAT render_unit_m;    // length of render space's unit
    BD_FLOAT noise_sign;       // of the halves' difference

    BD_UINT is_first_sub_frame; // 1: nothing was added before
    BD_UINT is_only_sub_frame;
    BD_UINT first_row; // of the slice
    BD_UINT row_count; // in it
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_composite_args) == 32, "std140 size");
#endif

#endif
