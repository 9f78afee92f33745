// Arguments of pass/glossy_blocks.
#ifndef BD_SHARED_GLOSSY_BLOCKS_H
#define BD_SHARED_GLOSSY_BLOCKS_H

#include "shared/types.h"

struct bd_glossy_blocks_args {
    BD_UINT level;     // of the blocks
    BD_UINT first_row; // of the slice
    BD_UINT row_count; // in it
    BD_UINT unused_0;

    BD_FLOAT normal_threshold;   // range of a component of the normal over a block
    BD_FLOAT material_threshold; // of a material's number
    BD_FLOAT unused_1;
    BD_FLOAT unused_2;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_glossy_blocks_args) == 32, "std140 size");
#endif

#endif
