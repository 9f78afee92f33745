// Arguments of pass/gather.
#ifndef BD_SHARED_GATHER_H
#define BD_SHARED_GATHER_H

#include "shared/types.h"

struct bd_gather_args {
    BD_UVEC4 rows; // x = first row of the slice, y = rows in it, z = 1 if nothing was added before
    BD_UVEC4 vpls; // x = first VPL of the slice, y = VPLs in it
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_gather_args) == 32, "std140 size");
#endif

#endif
