// Pixels that are in every VPL's first list already: what a gather does, at those.
#include "common/vpl_gather.glsl"
#include "pass/subsplats/lists.glsl"

layout(std430, binding = BD_STORAGE_SUBSPLATS) readonly buffer block_block { uint blocks[]; };
layout(binding = BD_IMAGE_GLOSSY_FINE, rgba32f) uniform image2D fine;

void main()
{
    uint at = args.blocks.z + gl_GlobalInvocationID.x;
    if (at >= args.blocks.w) return;
    uint code = blocks[args.blocks.x + at];
    ivec2 pixel = ivec2(BD_FRAGMENT_X(code), BD_FRAGMENT_Y(code));
    receiver r = gbuffer_receiver(pixel);
    vec3 viewer = direction_to_viewer(r.relative_position);
    sums s = no_light();
    uint end = args.vpls.x + args.vpls.y;
    for (uint first = args.vpls.x; first < end; first += 32u)
        gather_block(s, r, viewer, first, min(first + 32u, end));
    imageStore(fine, pixel, imageLoad(fine, pixel) + vec4(s.glossy, float(args.vpls.y)));
}
