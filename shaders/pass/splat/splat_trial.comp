// How many fragments all splats together would have, for each of several bounds: an invocation
// tries one, on a range of VPLs. Whole numbers, so that the order of the sums is nobody's business.
#include "common/splat_area.glsl"
#include "shared/splat.h"

layout(local_size_x = BD_SPLAT_BOUNDS) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_splat_trial_args args; };
// Low and high half of each sum.
layout(std430, binding = 0) buffer sum_block { uint sums[2 * BD_SPLAT_BOUNDS]; };

void main()
{
    uint trial = gl_LocalInvocationIndex;
    float bound = args.bounds[trial / 4u][trial % 4u];
    uint begin = gl_WorkGroupID.x * BD_SPLAT_TRIAL_VPLS;
    uint end = min(begin + BD_SPLAT_TRIAL_VPLS, args.vpl_count);
    uint low = 0u, high = 0u;
    for (uint i = begin; i < end; i++) {
        ivec4 area = splat_area(args.first_vpl + i, bound);
        uint fragments = uint(area.z - area.x) * uint(area.w - area.y);
        low += fragments;
        high += low < fragments ? 1u : 0u;
    }
    uint before = atomicAdd(sums[2u * trial], low);
    high += before + low < low ? 1u : 0u;
    if (high != 0u) atomicAdd(sums[2u * trial + 1u], high);
}
