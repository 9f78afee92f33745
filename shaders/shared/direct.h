// Arguments of pass/direct.
#ifndef BD_SHARED_DIRECT_H
#define BD_SHARED_DIRECT_H

#include "shared/types.h"

struct bd_direct_args {
    BD_UINT first_row; // of the slice
    BD_UINT row_count; // in it
    BD_UINT is_first;  // 1: nothing was added before, this is the first light
    BD_UINT unused_0;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_direct_args) == 16, "std140 size");
#endif

#endif
