// The children of blocks of a list, one by one (shared/surfaces.h).
#include "pass/surfaces/blocks.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = BD_STORAGE_OUTER_BLOCKS) readonly buffer outer_block { uint outer_blocks[]; };
layout(std430, binding = BD_STORAGE_OUTER_CHILDREN) writeonly buffer children_block { uvec2 children[]; };

struct block_seen {
    bool holds, split; // light; or it is split, and finer ones do
    receiver there;
};

block_seen look(ivec2 block)
{
    uint kind = BD_BLOCK_KIND(flags_of(args.level, block));
    block_seen b;
    b.holds = holds_light(args.level, kind);
    b.split = kind == BD_BLOCK_DISCONTINUOUS && !b.holds;
    ivec2 sure = b.holds ? block : ivec2(0); // its pixel is not asked for
    uint pixel = texelFetch(representative, multires_texel(args.level, uvec2(sure)), 0).x;
    if (!b.holds) pixel = 0u;
    b.there = gbuffer_receiver(unpacked(pixel));
    return b;
}

uint shared_with(receiver here, block_seen b, uint bit)
{
    return b.holds && is_one_surface(here, b.there) ? bit : 0u;
}

uint finer_kind(ivec2 block)
{
    if (multires_number(args.finer) > 0u) return BD_BLOCK_KIND(flags_of(args.finer, block));
    uint i = uint(block.x & 1) + 2u * uint(block.y & 1);
    return BD_BLOCK_CHILDREN(flags_of(args.level, block >> 1)) >> i & BD_BLOCK_SMOOTH;
}

uint cells_of(ivec2 child, receiver here, uint asked)
{
    const ivec2 steps[5] = ivec2[5](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(1, -1), ivec2(-1, 1));
    ivec2 side = (child & 1) * 2 - 1;
    uint cells = 0u;
    while (asked != 0u) {
        int i = findLSB(asked);
        asked &= asked - 1u;
        ivec2 cell = child + steps[i] * side;
        bool holds = holds_light(args.finer, finer_kind(cell));
        if (holds && is_one_surface(here, receiver_of(args.finer, cell))) cells |= 1u << i;
    }
    return cells;
}

void main()
{
    if (!is_in_list()) return;
    uint place = place_in_list();
    ivec2 block = unpacked(outer_blocks[args.first_outer + place]);
    uint lit = BD_BLOCK_CHILDREN(flags_of(args.level, block)), bits = lit << 24, cells = 0u;
    block_seen home = look(block);
    block_seen west = look(block + ivec2(-1, 0)), east = look(block + ivec2(1, 0));
    block_seen north = look(block + ivec2(0, -1)), south = look(block + ivec2(0, 1));
    block_seen north_west = look(block + ivec2(-1, -1)), north_east = look(block + ivec2(1, -1));
    block_seen south_west = look(block + ivec2(-1, 1)), south_east = look(block + ivec2(1, 1));
    for (uint left = lit; left != 0u; left &= left - 1u) {
        int i = findLSB(left);
        bool at_east = (i & 1) != 0, at_south = (i & 2) != 0;
        ivec2 child = 2 * block + ivec2(i & 1, i >> 1);
        receiver here = receiver_of(args.finer, child);
        block_seen along_x = at_east ? east : west, along_y = at_south ? south : north;
        block_seen along_both = at_south ? (at_east ? south_east : south_west) : (at_east ? north_east : north_west);
        uint shared_bits = shared_with(here, home, 1u) | shared_with(here, along_x, 2u) |
                           shared_with(here, along_y, 4u) | shared_with(here, along_both, 8u);
        block_seen back_x = at_east ? west : east, back_y = at_south ? north : south;
        shared_bits |= shared_with(here, back_x, 16u) | shared_with(here, back_y, 32u);
        uint asked = (along_x.split ? 0x9u : 0u) | (along_y.split ? 0x12u : 0u) | (along_both.split ? 0x4u : 0u);
        bits |= shared_bits << (6 * i);
        cells |= cells_of(child, here, asked) << (5 * i);
    }
    children[args.first_children + place] = uvec2(bits, cells);
}
