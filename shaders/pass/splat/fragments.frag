// One VPL's light on one fragment, to be added up (Nichols and Wyman 2010, 3.4): what the gather sums
// in a loop, a term at a time. BD_FINE: fragments of level 0, pixels.
#include "common/block_receiver.glsl"
#include "shared/splat.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_splat_fragments_args args; };
flat in uint splat_fragment, splat_vpl;
layout(location = 0) out vec4 light;
#ifdef BD_VECTOR
layout(location = 1) out vec4 vector;
#endif

void main()
{
    ivec2 block = ivec2(BD_FRAGMENT_X(splat_fragment), BD_FRAGMENT_Y(splat_fragment));
#ifdef BD_FINE
    receiver r = gbuffer_receiver(block);
#else
    receiver r = block_receiver(BD_FRAGMENT_LEVEL(splat_fragment), block);
#endif
    sums s = no_light();
    if (r.lit) gather_block(s, r, vec3(0.0), splat_vpl, splat_vpl + 1u);
    // The very first VPL of all marks the fragment as data.
    float data = splat_vpl == 0u && args.vpls.y != 0u ? 1.0 : 0.0;
    light = vec4(s.diffuse, data);
#ifdef BD_VECTOR
    vector = vec4(s.vector, data);
#endif
}
