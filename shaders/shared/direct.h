// Arguments of pass/direct.
#ifndef BD_SHARED_DIRECT_H
#define BD_SHARED_DIRECT_H

#include "shared/types.h"

struct bd_direct_args {
    BD_UVEC4 rows; // x = first row of the slice, y = rows in it, z = 1 if this is the first light
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_direct_args) == 16, "std140 size");
#endif

#endif
