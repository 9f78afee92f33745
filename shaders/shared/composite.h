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
    // x = 1 / sub-frames (finish), y = cd/m^2 of the frame's light unit, z = metres of a render unit
    BD_VEC4 scale;
    // x = 1 for the first sub-frame, y = 1 where it is the only one; z = first row of the slice, w = rows in it
    BD_UVEC4 state;
    // xy = where the picture begins whose doubt indirect light has, z = of its pixels, one over a
    // side
    BD_VEC4 doubted;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_composite_args) == 48, "std140 size");
#endif

#endif
