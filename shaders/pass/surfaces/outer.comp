// What the blocks of a list are, from the pairs; those that are not inner ones are listed again, for their
// children to be looked at. The order is that in which they come, which nothing depends on: each is
// worked on by itself.
#include "pass/surfaces/lists.glsl"

layout(local_size_x = 64) in;
layout(binding = BD_UNIT_BLOCK_FLAGS) uniform usampler2D flags;
layout(binding = BD_UNIT_BLOCK_PAIRS) uniform usampler2D pairs;
layout(binding = 0, r32ui) writeonly uniform uimage2D surfaces;
layout(std430, binding = BD_STORAGE_LOOK_BLOCKS) readonly buffer look_block { uint look_blocks[]; };
layout(std430, binding = BD_STORAGE_OUTER_BLOCKS) writeonly buffer outer_block { uint outer_blocks[]; };

// Before the first row or column a block's number wraps, and no level has such a block.
uint pairs_of(ivec2 block)
{
    if (!multires_has(args.level, uvec2(block))) return 0u;
    return texelFetch(pairs, multires_texel(args.level, uvec2(block)), 0).x;
}

// The eight around a block hold light of its surface. Four of the pairs are its own.
bool all_around(ivec2 block)
{
    uint west = pairs_of(block + ivec2(-1, 0)), north = pairs_of(block + ivec2(0, -1));
    uint north_west = pairs_of(block - 1), north_east = pairs_of(block + ivec2(1, -1));
    return pairs_of(block) == BD_SURFACES_ALL_PAIRS &&
           (west & 1u) + (north & 2u) + (north_west & 4u) + (north_east & 8u) == BD_SURFACES_ALL_PAIRS;
}

// Whether all is of one surface around a block, nothing jumps in it, and neither it nor a neighbour is cut
// by the picture's edge.
bool is_inner(ivec2 block)
{
    bool uncut = all(lessThanEqual(uvec2(block + 2) << multires_number(args.level), uvec2(args.width_px, args.height_px)));
    uint flag = texelFetch(flags, multires_texel(args.level, uvec2(block)), 0).x;
    bool whole = BD_BLOCK_KIND(flag) == BD_BLOCK_SMOOTH && BD_BLOCK_CHILDREN(flag) == 15u;
    return uncut && whole && all_around(block);
}

void main()
{
    if (!is_in_list()) return;
    uint packed_block = look_blocks[place_in_list()], word = 0u;
    ivec2 block = unpacked(packed_block);
    if (is_inner(block)) {
        // Blocks that are not split may be of several surfaces.
        bool is_deep = multires_number(args.level) > args.finest_level;
        word = is_deep ? BD_SURFACES_INNER | BD_SURFACES_DEEP : BD_SURFACES_INNER;
    } else {
        outer_blocks[args.first_outer + atomicAdd(counts[multires_number(args.level)].y, 1u)] = packed_block;
    }
    imageStore(surfaces, multires_texel(args.level, uvec2(block)), uvec4(word));
}
