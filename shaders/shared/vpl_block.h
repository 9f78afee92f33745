// Arguments of whoever makes VPLs from blocks of a light's map (shaders/common/vpl_block.glsl).
#ifndef BD_SHARED_VPL_BLOCK_H
#define BD_SHARED_VPL_BLOCK_H

#include "shared/types.h"

#define BD_VPL_KERNEL_PATCH 0u
#define BD_VPL_KERNEL_DISK  1u
#define BD_VPL_KERNEL_POINT 2u

struct bd_vpl_block_args {
    BD_UINT kernel;               // BD_VPL_KERNEL_*
    BD_UINT has_one_weight_layer; // 1: it serves every face
    BD_UINT face;                 // of the light's map
    BD_UINT unused_0;

    BD_FLOAT near_field; // distance, in radii of the patch, below which it is integrated exactly
    BD_FLOAT unused_1;
    BD_FLOAT unused_2;
    BD_FLOAT unused_3;
};

// As a member of other structs: GLSL knows no `struct NAME`.
#ifdef BD_GLSL
#define BD_VPL_BLOCK_ARGS bd_vpl_block_args
#else
#define BD_VPL_BLOCK_ARGS struct bd_vpl_block_args
_Static_assert(sizeof(struct bd_vpl_block_args) == 32, "std140 size");
#endif

#endif
