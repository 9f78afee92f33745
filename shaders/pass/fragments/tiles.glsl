// Tiles of blocks and their bit masks (shared/fragments.h).
#include "common/multires.glsl"
#include "shared/bindings.h"
#include "shared/fragments.h"

layout(local_size_x = BD_FRAGMENT_GROUP) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_fragments_args args; };

// Of the range of the dispatch.
uint item_index() { return args.first_item + gl_GlobalInvocationID.x; }

uint level_of_tile(uint tile)
{
    uint level = 0u;
    while (tile < args.tiles[level].first) level++;
    return level;
}

// Where a block's bit is.
uint half_tile_of(uint level, uvec2 block)
{
    bd_fragment_tiles tiles = args.tiles[level];
    uvec2 tile = block / BD_FRAGMENT_TILE_SIDE;
    return 2u * (tiles.first + tile.y * tiles.columns + tile.x) + block.y % BD_FRAGMENT_TILE_SIDE / 4u;
}

uint bit_of(uvec2 block) { return 8u * (block.y % 4u) + block.x % BD_FRAGMENT_TILE_SIDE; }

// The block of bit 0 of a half tile.
uvec2 first_block(uint level, uint half_tile)
{
    bd_fragment_tiles tiles = args.tiles[level];
    uint at = (half_tile >> 1u) - tiles.first, row = at / tiles.columns;
    return uvec2(at - row * tiles.columns, row) * BD_FRAGMENT_TILE_SIDE +
           uvec2(0u, (half_tile & 1u) * (BD_FRAGMENT_TILE_SIDE / 2u));
}
