// Arguments of pass/vpl_grid.
#ifndef BD_SHARED_VPL_GRID_H
#define BD_SHARED_VPL_GRID_H

#include "shared/vpl_block.h"

struct bd_vpl_grid_args {
    BD_VPL_BLOCK_ARGS block;

    BD_UINT grid_side; // VPLs along a face's side
    BD_UINT first_row; // of the slice
    BD_UINT row_count; // in it
    BD_UINT unused_0;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_vpl_grid_args) == 48, "std140 size");
#endif

#endif
