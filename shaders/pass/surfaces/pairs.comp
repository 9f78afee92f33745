// Pairs of neighbours (shared/surfaces.h), of the blocks of a list.
#include "pass/surfaces/blocks.glsl"

layout(local_size_x = 64) in;
layout(binding = 0, r32ui) writeonly uniform uimage2D pairs;
layout(std430, binding = BD_STORAGE_LOOK_BLOCKS) readonly buffer look_block { uint look_blocks[]; };

uint pair(ivec2 other, receiver here, uint bit)
{
    bool both = holds_light(args.level, BD_BLOCK_KIND(flags_of(args.level, other)));
    return both && is_one_surface(here, receiver_of(args.level, other)) ? bit : 0u;
}

void main()
{
    if (!is_in_list()) return;
    ivec2 block = unpacked(look_blocks[place_in_list()]);
    receiver here = receiver_of(args.level, block);
    uint word = pair(block + ivec2(1, 0), here, 1u) | pair(block + ivec2(0, 1), here, 2u);
    word |= pair(block + ivec2(1, 1), here, 4u) | pair(block + ivec2(-1, 1), here, 8u);
    imageStore(pairs, multires_texel(args.level, uvec2(block)), uvec4(word));
}
