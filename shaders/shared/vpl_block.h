// Arguments of whoever makes VPLs from blocks of a light's map (shaders/common/vpl_block.glsl).
#ifndef BD_SHARED_VPL_BLOCK_H
#define BD_SHARED_VPL_BLOCK_H

#include "shared/types.h"

#define BD_VPL_KERNEL_PATCH 0u
#define BD_VPL_KERNEL_DISK  1u
#define BD_VPL_KERNEL_POINT 2u

struct bd_vpl_block_args {
    BD_UVEC4 how;   // x = BD_VPL_KERNEL_*, y = 1: one weight layer serves every face, z = face
    BD_VEC4 limits; // x = distance, in radii of the patch, below which it is integrated exactly
};

// As a member of other structs: GLSL knows no `struct NAME`.
#ifdef BD_GLSL
#define BD_VPL_BLOCK_ARGS bd_vpl_block_args
#else
#define BD_VPL_BLOCK_ARGS struct bd_vpl_block_args
_Static_assert(sizeof(struct bd_vpl_block_args) == 32, "std140 size");
#endif

#endif
