// Arguments of pass/gather.
#ifndef BD_SHARED_GATHER_H
#define BD_SHARED_GATHER_H

#include "shared/types.h"

struct bd_gather_args {
    BD_UVEC4 tile; // of the slice: xy = its first pixel, zw = its width and height
    BD_UVEC4 vpls; // x = first VPL of the slice, y = VPLs in it, z = 1 if nothing was added before
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_gather_args) == 32, "std140 size");
#endif

#endif
