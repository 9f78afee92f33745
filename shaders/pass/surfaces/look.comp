// Which blocks of a level are to be looked at: a list, in the order in which they come.
//
// Not those under a deep block: light was gathered once for it and for each around it, all of one
// surface, and what is finer than they are nobody asked about light.
#include "pass/surfaces/lists.glsl"
#include "shared/multires.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = BD_UNIT_BLOCK_FLAGS) uniform usampler2D flags;
layout(binding = BD_UNIT_BLOCK_SURFACES) uniform usampler2D coarser_surfaces;
layout(binding = 0, r32ui) writeonly uniform uimage2D surfaces;
layout(binding = 1, r32ui) writeonly uniform uimage2D pairs;
layout(std430, binding = BD_STORAGE_LOOK_BLOCKS) writeonly buffer look_block { uint look_blocks[]; };

bool is_under_deep(uvec2 block)
{
    uvec2 parent = block >> 1u;
    if (!multires_has(args.coarser, parent)) return false;
    return (texelFetch(coarser_surfaces, multires_texel(args.coarser, parent), 0).x & BD_SURFACES_DEEP) != 0u;
}

void main()
{
    uvec2 block = gl_GlobalInvocationID.xy + uvec2(0u, args.first_row);
    if (gl_GlobalInvocationID.y >= args.row_count || !multires_has(args.level, block)) return;
    ivec2 at = multires_texel(args.level, block);
    bool deep = is_under_deep(block);
    if (!deep && holds_light(args.level, BD_BLOCK_KIND(texelFetch(flags, at, 0).x)))
        look_blocks[atomicAdd(counts[multires_number(args.level)].x, 1u)] = BD_PIXEL_PACK(block.x, block.y);
    imageStore(pairs, at, uvec4(deep ? BD_SURFACES_ALL_PAIRS : 0u));
    imageStore(surfaces, at, uvec4(deep ? BD_SURFACES_INNER | BD_SURFACES_DEEP : 0u));
}
