// A layer's sum over sub-frames as it is shown: depth and normal are averaged over those that hit
// something. `sum` is already divided by how many there are.
#include "shared/composite.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_composite_args args; };

const float DEPTH_OF_NOTHING_M = 1e10;

vec4 finished(uint which, vec4 sum)
{
    if (which == uint(BD_COMPOSITE_NORMAL))
        return dot(sum.xyz, sum.xyz) > 0.0 ? vec4(normalize(sum.xyz), sum.w) : vec4(0.0);
    if (which == uint(BD_COMPOSITE_DEPTH))
        return sum.w > 0.0 ? vec4(vec3(sum.x / sum.w), sum.w) : vec4(vec3(DEPTH_OF_NOTHING_M), 0.0);
    return sum;
}
