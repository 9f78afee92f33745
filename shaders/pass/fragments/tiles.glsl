// Tiles of blocks and their bit masks (shared/fragments.h).
#include "common/multires.glsl"
#include "shared/bindings.h"
#include "shared/fragments.h"

layout(local_size_x = BD_FRAGMENT_GROUP) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_fragments_args args; };

// Of the range of the dispatch.
uint item_index() { return args.range.x + gl_GlobalInvocationID.x; }

uint level_of_tile(uint tile)
{
    uint level = 0u;
    while (tile < args.tiles[level].x) level++;
    return level;
}

// The block of bit 0 of a half tile.
uvec2 first_block(uint level, uint half_tile)
{
    uvec4 tiles = args.tiles[level];
    uint at = (half_tile >> 1u) - tiles.x, row = at / tiles.y;
    return uvec2(at - row * tiles.y, row) * BD_FRAGMENT_TILE_SIDE +
           uvec2(0u, (half_tile & 1u) * (BD_FRAGMENT_TILE_SIDE / 2u));
}
