// One VPL's light on one fragment, to be added up (Nichols and Wyman 2010, 3.4): what the gather sums
// in a loop, a term at a time. A VPL an instance, a fragment of the picture a vertex: a point in the
// texel that is the fragment's.
//
// The light is worked out here, since a point is one texel: on the software device the stage takes a
// quarter of the time that it takes in the fragment shader.
#include "common/block_receiver.glsl"
#include "shared/splat.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_splat_fragments_args args; };
layout(location = 0) in uint fragment;
flat out vec4 splat_light;
#ifdef BD_VECTOR
flat out vec4 splat_vector;
#endif

void main()
{
    uint vpl = args.first_vpl + uint(gl_InstanceID), level = BD_FRAGMENT_LEVEL(fragment);
    ivec2 block = ivec2(BD_FRAGMENT_X(fragment), BD_FRAGMENT_Y(fragment));
#ifdef BD_FINE
    receiver r = gbuffer_receiver(block);
    ivec2 texel = block;
#else
    receiver r = block_receiver(level, block);
    ivec2 texel = in_stack(level, block);
#endif
    sums s = no_light();
    if (r.lit) gather_block(s, r, vec3(0.0), vpl, vpl + 1u);
    // The very first VPL of all marks the fragment as data.
    float data = vpl == 0u && args.is_first_list != 0u ? 1.0 : 0.0;
    splat_light = vec4(s.diffuse, data);
#ifdef BD_VECTOR
    splat_vector = vec4(irradiance_vector(s, r.normal), data);
#endif
    vec2 at = (vec2(texel) + 0.5) / vec2(args.size_px.xy);
    gl_Position = vec4(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.5, 1.0);
}
