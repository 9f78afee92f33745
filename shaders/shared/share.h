// Arguments of pass/share.
#ifndef BD_SHARED_SHARE_H
#define BD_SHARED_SHARE_H

#include "shared/types.h"

struct bd_share_args {
    // xy = where in a pixel the first sub-frame looks through, z = pixels along a side of one of
    // its
    BD_VEC4 first_sample_px;
    BD_VEC4 first_origin_px; // xy = where its picture begins
    BD_UVEC4 rows;           // x = first row of the slice, y = rows in it
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_share_args) == 48, "std140 size");
#endif

#endif
