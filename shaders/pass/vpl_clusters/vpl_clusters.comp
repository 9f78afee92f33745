// One VPL for each fragment of a light's view: blocks of several sizes (algorithms.md A2.3).
#include "shared/bindings.h"
#include "shared/multires.h"
#include "shared/vpl_clusters.h"

#ifdef BD_GROUP_PER_VPL
layout(local_size_x = 1024) in;
#else
layout(local_size_x = 64) in;
#endif
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_vpl_clusters_args args; };
layout(std430, binding = BD_STORAGE_FRAGMENT_LIST) readonly buffer list_block { uint fragments[]; };

#include "common/vpl_block.glsl"

void main()
{
#ifdef BD_GROUP_PER_VPL
    uint i = gl_WorkGroupID.x;
#else
    uint i = gl_GlobalInvocationID.x;
#endif
    if (i >= args.fragment_count) return;
    uint at = args.first_fragment + i, fragment = fragments[at], level = BD_FRAGMENT_LEVEL(fragment);
    ivec2 begin = ivec2(BD_FRAGMENT_X(fragment), BD_FRAGMENT_Y(fragment)) << int(level);
    ivec2 end = min(begin + (1 << int(level)), ivec2(light.face_side_px));
    make_vpl(begin, end, args.vpls_before + at);
}
