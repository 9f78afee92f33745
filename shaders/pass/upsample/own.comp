// Pixels that are fragments keep what they gathered.
#include "pass/upsample/light.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = BD_STORAGE_FRAGMENTS) readonly buffer fragments_block { uint fragments[]; };

void main()
{
    if (gl_GlobalInvocationID.x >= args.item_count) return;
    uint fragment = fragments[args.first_item + gl_GlobalInvocationID.x];
    ivec2 pixel = ivec2(BD_FRAGMENT_X(fragment), BD_FRAGMENT_Y(fragment));
    light l = light_of_child(pixel);
#if BD_DETAIL == BD_DETAIL_DIRECTION
    vec3 e = l.irradiance; // for the pixel's own normal
#else
    vec3 e = with_detail(l, pixel);
#endif
    imageStore(irradiance, pixel, vec4(e, l.state));
#if defined(BD_KEEP_VECTOR) && !defined(BD_FINE_VECTOR)
    // It was gathered for the pixel's normal alone: for others near that one, by the cosine.
    l.vector = gbuffer_receiver(pixel).normal * all_channels(l.irradiance);
#endif
    keep(pixel, l);
}
