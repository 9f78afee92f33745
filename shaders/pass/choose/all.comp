// Segments from every pixel of a tile to every VPL of a range: 32 for each word of answers.
#include "common/segments.glsl"
#include "shared/choose.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_choose_args args; };

void main()
{
    uvec2 at = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(at, args.tile.zw))) return;
    ivec2 pixel = ivec2(at + args.tile.xy);
    receiver r = gbuffer_receiver(pixel);
    uint triangle = receiver_triangle(pixel);
    uint first = (at.y * args.tile.z + at.x) * args.vpls.z * 32u;
    for (uint i = 0u; i < args.vpls.z * 32u; i++) {
        uint vpl = args.vpls.x + min(i, args.vpls.y - 1u);
        if (i < args.vpls.y && is_reached(r, vpl_at(vpl)))
            store_segment_to(first + i, r, triangle, vpl);
        else
            store_no_segment(first + i);
    }
}
