// Pixels that are in every VPL's first list already: what a gather does, at those.
#include "common/vpl_gather.glsl"
#include "pass/subsplats/lists.glsl"

layout(std430, binding = BD_STORAGE_SUBSPLATS) readonly buffer block_block { uint blocks[]; };
layout(binding = BD_IMAGE_GLOSSY_FINE, rgba32f) uniform image2D fine;

void main()
{
    uint at = args.first_block + gl_GlobalInvocationID.x;
    if (at >= args.end_block) return;
    uint code = blocks[args.list_first_block + at];
    ivec2 pixel = ivec2(BD_FRAGMENT_X(code), BD_FRAGMENT_Y(code));
    receiver r = gbuffer_receiver(pixel);
    vec3 viewer = direction_to_viewer(r.relative_position);
    sums s = no_light();
    uint end = args.first_vpl + args.vpl_count;
    for (uint first = args.first_vpl; first < end; first += 32u)
        gather_block(s, r, viewer, first, min(first + 32u, end));
    imageStore(fine, pixel, imageLoad(fine, pixel) + vec4(s.glossy, float(args.vpl_count)));
}
