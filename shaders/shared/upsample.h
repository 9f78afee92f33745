// Arguments of pass/upsample.
#ifndef BD_SHARED_UPSAMPLE_H
#define BD_SHARED_UPSAMPLE_H

#include "shared/types.h"

// The order of enum bd_surface_detail (pass/upsample.h).
#define BD_DETAIL_OFF       0
#define BD_DETAIL_DIRECTION 1
#define BD_DETAIL_PAPER     2

// Levels as in bd_multires_layout, w = which. As arguments of their own: the software device reads
// a member of an array by a number that it does not know for each invocation by itself.
struct bd_upsample_args {
    BD_UVEC4 rows; // x = first row of parents of the slice, or first of a list; y = how many; where
                   // those of the level begin: z = outer blocks, w = their children's words
    BD_UVEC4 level;   // of the children
    BD_UVEC4 above;   // of their parents; of no blocks if the children are the coarsest
    BD_UVEC4 size_px; // xy = the picture
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_upsample_args) == 64, "std140 size");
#endif

#endif
