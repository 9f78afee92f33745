// Which blocks are fragments (pass/fragments.h).
#include "common/blocks.glsl"
#include "shared/fragments.h"

layout(std430, binding = BD_STORAGE_FRAGMENT_MASKS) readonly buffer mask_block { uint fragment_masks[]; };

uvec2 tiles_of_level(uint level)
{
    return (uvec2(blocks_of_level(level)) + BD_FRAGMENT_TILE_SIDE - 1u) / BD_FRAGMENT_TILE_SIDE;
}

bool is_fragment(uint level, ivec2 block)
{
    uint before = 0u;
    for (uint coarser = coarsest_level(); coarser > level; coarser--) {
        uvec2 tiles = tiles_of_level(coarser);
        before += tiles.x * tiles.y;
    }
    uvec2 tile = uvec2(block) / BD_FRAGMENT_TILE_SIDE, inside = uvec2(block) % BD_FRAGMENT_TILE_SIDE;
    uint half_tile = 2u * (before + tile.y * tiles_of_level(level).x + tile.x) + inside.y / 4u;
    return (fragment_masks[half_tile] >> (8u * (inside.y % 4u) + inside.x) & 1u) != 0u;
}
