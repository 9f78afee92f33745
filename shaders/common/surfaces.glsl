// What pass/surfaces left of blocks. `level` is as in bd_multires_layout, with its number in w.
#include "common/multires.glsl"
#include "shared/bindings.h"
#include "shared/surfaces.h"

layout(binding = BD_UNIT_BLOCK_SURFACES) uniform usampler2D surfaces;

// Before the first row or column a block's number wraps, and no level has such a block.
uint word_of(uvec4 level, ivec2 block)
{
    if (!multires_has(level, uvec2(block))) return 0u;
    return texelFetch(surfaces, multires_texel(level, uvec2(block)), 0).x;
}

// Bit 3 y + x of nine: the block at (x, y) - 1 from this one holds light of its surface.
const uint ALL_NINE = 0x1ffu;

uint nine_of(uvec4 level, ivec2 block, uint word)
{
    uint west = word_of(level, block + ivec2(-1, 0)), north = word_of(level, block + ivec2(0, -1));
    uint north_west = word_of(level, block - 1), north_east = word_of(level, block + ivec2(1, -1));
    uint nine = (word & BD_SURFACES_HOLDS) != 0u ? 0x10u : 0u;
    nine |= (word & 1u) << 5 | (word & 2u) << 6 | (word & 4u) << 6 | (word & 8u) << 3;
    return nine | (west & 1u) << 3 | (north & 2u) | (north_west & 4u) >> 2 | (north_east & 8u) >> 1;
}

// Whether all is of one surface around a block, and neither it nor a neighbour is cut by the picture's
// edge.
bool is_inner(uvec4 level, ivec2 block, uint word, uint nine, uvec2 size_px)
{
    bool uncut = all(lessThanEqual(uvec2(block + 2) << level.w, size_px));
    return uncut && nine == ALL_NINE && (word & BD_SURFACES_WHOLE) != 0u;
}
