// Arguments of pass/vpl_clusters.
#ifndef BD_SHARED_VPL_CLUSTERS_H
#define BD_SHARED_VPL_CLUSTERS_H

#include "shared/vpl_block.h"

struct bd_vpl_clusters_args {
    BD_VPL_BLOCK_ARGS block;

    BD_UINT first_fragment; // of the slice
    BD_UINT fragment_count; // in it
    BD_UINT vpls_before;    // of the faces before
    BD_UINT unused_0;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_vpl_clusters_args) == 48, "std140 size");
#endif

#endif
