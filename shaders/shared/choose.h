// Arguments of pass/choose.
#ifndef BD_SHARED_CHOOSE_H
#define BD_SHARED_CHOOSE_H

#include "shared/types.h"

struct bd_choose_args {
    BD_UVEC4 tile; // of the slice: xy = its first pixel, zw = its width and height
    BD_UVEC4 vpls; // x = first VPL of the slice, y = VPLs in it, z = words of answers a receiver
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_choose_args) == 32, "std140 size");
#endif

#endif
