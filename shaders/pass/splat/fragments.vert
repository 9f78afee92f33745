// A VPL an instance, a fragment of the picture a vertex: a point in the texel that is the fragment's.
#include "common/blocks.glsl"
#include "shared/splat.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_splat_fragments_args args; };
layout(location = 0) in uint fragment;
flat out uint splat_fragment, splat_vpl;

void main()
{
    splat_fragment = fragment;
    splat_vpl = args.vpls.x + uint(gl_InstanceID);
    uint level = BD_FRAGMENT_LEVEL(fragment);
    ivec2 block = ivec2(BD_FRAGMENT_X(fragment), BD_FRAGMENT_Y(fragment));
    ivec2 texel = level == 0u ? block : in_stack(level, block);
    vec2 at = (vec2(texel) + 0.5) / vec2(args.size_px.xy);
    gl_Position = vec4(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.5, 1.0);
}
