// Gather at a list of fragments (algorithms.md A2.2): each sums a range of VPLs, in their order.
#include "common/fragment_gather.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = BD_STORAGE_FRAGMENTS) readonly buffer fragments_block { uint fragments[]; };

void main()
{
    if (gl_GlobalInvocationID.x >= args.fragment_count) return;
    uint fragment = fragments[args.first_fragment + gl_GlobalInvocationID.x];
    gather_at(BD_FRAGMENT_LEVEL(fragment), ivec2(BD_FRAGMENT_X(fragment), BD_FRAGMENT_Y(fragment)),
              gl_GlobalInvocationID.x);
}
