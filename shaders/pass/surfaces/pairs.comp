// Blocks and pairs of neighbours (shared/surfaces.h).
#include "pass/surfaces/blocks.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, r32ui) writeonly uniform uimage2D words;

uint pair(ivec2 other, receiver here, uint bit)
{
    bool both = holds_light(args.level, flag_of(args.level, other));
    return both && is_one_surface(here, receiver_of(args.level, other)) ? bit : 0u;
}

bool is_lit(ivec2 child) { return flag_of(args.finer, child) != BD_BLOCK_EMPTY; }

void main()
{
    ivec2 block = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.rows.x), child = 2 * block;
    if (gl_GlobalInvocationID.y >= args.rows.y || !multires_has(args.level, uvec2(block))) return;
    uint flag = flag_of(args.level, block), word = BD_SURFACES_HOLDS;
    receiver here = receiver_of(args.level, block);
    word |= pair(block + ivec2(1, 0), here, 1u) | pair(block + ivec2(0, 1), here, 2u);
    word |= pair(block + ivec2(1, 1), here, 4u) | pair(block + ivec2(-1, 1), here, 8u);
    if (flag == BD_BLOCK_SMOOTH && is_lit(child) && is_lit(child + ivec2(1, 0)) &&
        is_lit(child + ivec2(0, 1)) && is_lit(child + 1))
        word |= BD_SURFACES_WHOLE;
    imageStore(words, multires_texel(args.level, uvec2(block)),
               uvec4(holds_light(args.level, flag) ? word : 0u));
}
