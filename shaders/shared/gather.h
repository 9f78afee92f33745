// Arguments of pass/gather.
#ifndef BD_SHARED_GATHER_H
#define BD_SHARED_GATHER_H

#include "shared/types.h"

struct bd_gather_args {
    // The slice: a tile of the picture.
    BD_UINT tile_x_px;
    BD_UINT tile_y_px;
    BD_UINT tile_width_px;
    BD_UINT tile_height_px;

    // And a range of the VPLs.
    BD_UINT first_vpl;
    BD_UINT vpl_count;
    BD_UINT is_first; // 1: nothing was added before
    BD_UINT unused_0;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_gather_args) == 32, "std140 size");
#endif

#endif
