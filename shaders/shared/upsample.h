// Arguments of pass/upsample.
#ifndef BD_SHARED_UPSAMPLE_H
#define BD_SHARED_UPSAMPLE_H

#include "shared/multires.h"

// The order of enum bd_surface_detail (pass/upsample.h).
#define BD_DETAIL_OFF       0
#define BD_DETAIL_DIRECTION 1
#define BD_DETAIL_PAPER     2

// Levels as arguments of their own: the software device reads a member of an array by a number that
// it does not know for each invocation by itself.
struct bd_upsample_args {
    BD_UINT first_row;      // of the slice, where it is rows of parents
    BD_UINT row_count;      // in it
    BD_UINT first_outer;    // where the parents' level begins in the list of outer blocks
    BD_UINT first_children; // and in that of their children's words

    BD_MULTIRES_LEVEL level; // of the children
    BD_MULTIRES_LEVEL above; // of their parents; of no blocks if the children are the coarsest

    BD_UINT first_item; // of the slice, where it is a list: of outer blocks, or of fragments
    BD_UINT item_count; // in it
    BD_UINT unused_0;
    BD_UINT unused_1;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_upsample_args) == 64, "std140 size");
#endif

#endif
