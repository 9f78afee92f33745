// Arguments of pass/gather_fragments.
#ifndef BD_SHARED_GATHER_FRAGMENTS_H
#define BD_SHARED_GATHER_FRAGMENTS_H

#include "shared/types.h"

struct bd_gather_fragments_args {
    BD_UINT first_fragment; // of the slice
    BD_UINT fragment_count; // in it
    BD_UINT is_first;       // 1: nothing was added before
    BD_UINT finest_level;   // whose blocks may hold several surfaces

    BD_UINT first_vpl;          // of the slice
    BD_UINT vpl_count;          // in it
    BD_UINT words_per_receiver; // of answers, 32 VPLs each
    BD_UINT unused_0;

    BD_FLOAT depth; // of the draw behind the mask
    BD_FLOAT variance_part; // of noise, that the filter goes by
    BD_FLOAT unused_2;
    BD_FLOAT unused_3;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_gather_fragments_args) == 48, "std140 size");
#endif

#endif
