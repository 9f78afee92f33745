// Arguments of pass/share.
#ifndef BD_SHARED_SHARE_H
#define BD_SHARED_SHARE_H

#include "shared/types.h"

struct bd_share_args {
    BD_VEC4 first_sample_px; // xy = where in a pixel the first sub-frame looks through
    BD_UVEC4 rows;           // x = first row of the slice, y = rows in it
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_share_args) == 32, "std140 size");
#endif

#endif
