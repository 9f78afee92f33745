// Arguments of pass/shared_light.
#ifndef BD_SHARED_SHARED_LIGHT_H
#define BD_SHARED_SHARED_LIGHT_H

#include "shared/types.h"

struct bd_share_args {
    BD_VEC4 first_sample_px; // xy = where in a pixel the first sub-frame looks through
    BD_VEC4 first_origin_px; // xy = where its picture begins

    BD_FLOAT first_side_px; // pixels along a side of one of its
    BD_UINT first_row;      // of the slice
    BD_UINT row_count;      // in it
    BD_UINT unused_0;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_share_args) == 48, "std140 size");
#endif

#endif
