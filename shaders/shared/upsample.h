// Arguments of pass/upsample.
#ifndef BD_SHARED_UPSAMPLE_H
#define BD_SHARED_UPSAMPLE_H

#include "shared/types.h"

// The order of enum bd_surface_detail (pass/upsample.h).
#define BD_DETAIL_OFF       0
#define BD_DETAIL_DIRECTION 1
#define BD_DETAIL_PAPER     2

struct bd_upsample_args {
    BD_UVEC4 rows; // x = level, y = first row of the slice, z = rows in it
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_upsample_args) == 16, "std140 size");
#endif

#endif
