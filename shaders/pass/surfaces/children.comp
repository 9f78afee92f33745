// The children of blocks of a list, one by one (shared/surfaces.h).
#include "pass/surfaces/blocks.glsl"

layout(local_size_x = 64) in;
layout(binding = BD_UNIT_OUTER_BLOCKS) uniform usampler2D outer_blocks;
layout(binding = 0, rg32ui) writeonly uniform uimage2D children;

uint bits_of(ivec2 child, receiver here)
{
    const ivec2 steps[6] = ivec2[6](ivec2(0, 0), ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(-1, 0),
                                    ivec2(0, -1));
    ivec2 side = (child & 1) * 2 - 1;
    uint bits = 0u;
    for (int i = 0; i < 6; i++) {
        ivec2 other = (child >> 1) + steps[i] * side;
        bool holds = holds_light(args.level, flag_of(args.level, other));
        if (holds && is_one_surface(here, receiver_of(args.level, other))) bits |= 1u << i;
    }
    return bits;
}

bool is_split(ivec2 block)
{
    uint flag = flag_of(args.level, block);
    return flag == BD_BLOCK_DISCONTINUOUS && !holds_light(args.level, flag);
}

uint cells_of(ivec2 child, receiver here)
{
    const ivec2 steps[5] = ivec2[5](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(1, -1), ivec2(-1, 1));
    ivec2 side = (child & 1) * 2 - 1, parent = child >> 1;
    uint asked = (is_split(parent + ivec2(side.x, 0)) ? 0x9u : 0u) |
                 (is_split(parent + ivec2(0, side.y)) ? 0x12u : 0u) | (is_split(parent + side) ? 0x4u : 0u);
    uint cells = 0u;
    while (asked != 0u) {
        int i = findLSB(asked);
        asked &= asked - 1u;
        ivec2 cell = child + steps[i] * side;
        bool holds = holds_light(args.finer, flag_of(args.finer, cell));
        if (holds && is_one_surface(here, receiver_of(args.finer, cell))) cells |= 1u << i;
    }
    return cells;
}

void main()
{
    if (gl_GlobalInvocationID.x >= args.rows.y) return;
    uint place = args.rows.x + gl_GlobalInvocationID.x, width = args.level.x;
    ivec2 listed = multires_texel(args.level, uvec2(place % width, place / width));
    uint packed_block = texelFetch(outer_blocks, listed, 0).x, bits = 0u, cells = 0u;
    ivec2 block = ivec2(BD_PIXEL_X(packed_block), BD_PIXEL_Y(packed_block));
    for (int i = 0; i < 4; i++) {
        ivec2 child = 2 * block + ivec2(i & 1, i >> 1);
        if (flag_of(args.finer, child) == BD_BLOCK_EMPTY) continue;
        receiver here = receiver_of(args.finer, child);
        bits |= bits_of(child, here) << (6 * i) | 0x1000000u << i;
        cells |= cells_of(child, here) << (5 * i);
    }
    imageStore(children, listed, uvec4(bits, cells, 0u, 0u));
}
