// Arguments of pass/gather_fragments.
#ifndef BD_SHARED_GATHER_FRAGMENTS_H
#define BD_SHARED_GATHER_FRAGMENTS_H

#include "shared/types.h"

struct bd_gather_fragments_args {
    BD_UVEC4 fragments; // x = first of the slice, y = how many, z = 1 if nothing was added before,
                        // w = finest level, whose blocks may hold several surfaces
    BD_UVEC4 vpls;      // x = first VPL of the slice, y = VPLs in it, z = words of answers a
                        // fragment
    BD_VEC4 depth;      // x = of the draw behind the mask
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_gather_fragments_args) == 48, "std140 size");
#endif

#endif
