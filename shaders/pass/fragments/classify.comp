// Which blocks are fragments: a word of the mask for each half tile.
//
// One pass: every block decides for itself, by its parent's flag (algorithms.md A2.1). Iterative
// (BD_ITERATIVE): one dispatch a level, from the coarsest; a block is reached only if its parent was and
// is split. Flags that are monotone, as they are, make both the same.
#include "common/seen_surface.glsl"
#include "pass/fragments/tiles.glsl"

layout(binding = BD_UNIT_BLOCK_FLAGS) uniform usampler2D flags;
layout(std430, binding = BD_STORAGE_FRAGMENT_MASKS) writeonly buffer mask_block { uint masks[]; };
#ifdef BD_ITERATIVE
layout(std430, binding = BD_STORAGE_REACHED_MASKS) buffer reached_block { uint reached_masks[]; };
#endif

// Of a block of the level, or of a place where it has none.
uint block_flag(uint level, uvec2 block)
{
    uvec4 size = args.multires.levels[level];
    if (!multires_has(size, block)) return BD_BLOCK_EMPTY;
    if (level > 0u) return texelFetch(flags, multires_texel(size, block), 0).x;
    return seen_lit(ivec2(block), args.range.w) ? BD_BLOCK_SMOOTH : BD_BLOCK_EMPTY;
}

bool is_reached(uint level, uvec2 block)
{
#ifdef BD_ITERATIVE
    uvec4 tiles = args.tiles[level];
    uvec2 tile = block / BD_FRAGMENT_TILE_SIDE, inside = block % BD_FRAGMENT_TILE_SIDE;
    uint half_tile = 2u * (tiles.x + tile.y * tiles.y + tile.x) + inside.y / 4u;
    return (reached_masks[half_tile] >> (8u * (inside.y % 4u) + inside.x) & 1u) != 0u;
#else
    return true;
#endif
}

bool is_split(uint level, uvec2 block)
{
    if (level <= args.total.y) return false; // its blocks are whole, whatever they hold
    if (level == args.multires.size_px.z) return true; // the coarsest level's blocks have no parent
    return block_flag(level, block) == BD_BLOCK_DISCONTINUOUS && is_reached(level, block);
}

void main()
{
    uint half_tile = item_index();
    if (half_tile >= args.range.y) return;
    uint level = level_of_tile(half_tile >> 1u);
    uvec2 first = first_block(level, half_tile);
    uint mask = 0u, reached = 0u;
    bool finest = level == args.total.y;
    for (uint parent = 0u; parent < 8u; parent++) {
        uvec2 in_half = 2u * uvec2(parent % 4u, parent / 4u);
        if (!is_split(level + 1u, (first + in_half) / 2u)) continue;
        for (uint i = 0u; i < 4u; i++) {
            uvec2 at = in_half + uvec2(i & 1u, i >> 1u);
            uint flag = block_flag(level, first + at), bit = 1u << (8u * at.y + at.x);
            if (flag != BD_BLOCK_EMPTY) reached |= bit;
            if (flag == BD_BLOCK_SMOOTH || (finest && flag != BD_BLOCK_EMPTY)) mask |= bit;
        }
    }
    masks[half_tile] = mask;
#ifdef BD_ITERATIVE
    reached_masks[half_tile] = reached;
#endif
}
