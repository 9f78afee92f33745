// Arguments of pass/glossy_blocks.
#ifndef BD_SHARED_GLOSSY_BLOCKS_H
#define BD_SHARED_GLOSSY_BLOCKS_H

#include "shared/types.h"

struct bd_glossy_blocks_args {
    BD_UVEC4 rows;  // x = level, y = first row of the slice, z = rows in it
    BD_VEC4 limits; // x = range of a component of the normal, y = of a material's number
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_glossy_blocks_args) == 32, "std140 size");
#endif

#endif
