// Arguments of pass/vpl_clusters.
#ifndef BD_SHARED_VPL_CLUSTERS_H
#define BD_SHARED_VPL_CLUSTERS_H

#include "shared/vpl_block.h"

struct bd_vpl_clusters_args {
    BD_VPL_BLOCK_ARGS block;
    BD_UVEC4 slice; // x = first fragment of the slice, y = how many, z = VPLs of the faces before
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_vpl_clusters_args) == 48, "std140 size");
#endif

#endif
