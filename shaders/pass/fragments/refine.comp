// Children of fragments over which light changes too much: they are fragments, too.
#include "common/all_channels.glsl"
#include "common/seen_surface.glsl"
#include "pass/fragments/tiles.glsl"

layout(binding = BD_UNIT_BLOCK_FLAGS) uniform usampler2D flags;
layout(binding = BD_UNIT_FINE) uniform sampler2D light;
layout(binding = BD_UNIT_FINE_VECTOR) uniform sampler2D vectors; // a = the spread of light
layout(std430, binding = BD_STORAGE_FRAGMENT_MASKS) writeonly buffer mask_block { uint masks[]; };
layout(std430, binding = BD_STORAGE_REACHED_MASKS) readonly buffer parent_block { uint parent_masks[]; };
layout(std430, binding = BD_STORAGE_FIRST_MASKS) readonly buffer first_mask_block { uint first_masks[]; };

bool is_lit(uint level, uvec2 block)
{
    uvec4 size = args.multires.levels[level];
    if (!multires_has(size, block)) return false;
    if (level > 0u) return texelFetch(flags, multires_texel(size, block), 0).x != BD_BLOCK_EMPTY;
    return seen_lit(ivec2(block), args.range.w);
}

// Of the 4 x 2 blocks that half a tile's are children of, those whose bit is set; they lie in one word.
uint parents_of(uint level, uvec2 first)
{
    uvec4 tiles = args.tiles[level + 1u];
    uvec2 parent = first / 2u, tile = parent / BD_FRAGMENT_TILE_SIDE, inside = parent % BD_FRAGMENT_TILE_SIDE;
    uint word = parent_masks[2u * (tiles.x + tile.y * tiles.y + tile.x) + inside.y / 4u];
    uint rows = word >> (8u * (inside.y % 4u) + inside.x);
    return (rows & 0xfu) | (rows >> 4u & 0xf0u);
}

bool varies(uint level, uvec2 block)
{
    ivec2 at = multires_texel(args.multires.levels[level], block);
    return texelFetch(vectors, at, 0).a > args.limits.x * all_channels(texelFetch(light, at, 0).rgb);
}

void main()
{
    uint half_tile = item_index();
    if (half_tile >= args.range.y) return;
    uint level = level_of_tile(half_tile >> 1u);
    uvec2 first = first_block(level, half_tile);
    uint mask = 0u, parents = 0u;
    if (level + 1u < args.multires.size_px.z) parents = parents_of(level, first);
    // In most there are none: a software device skips a loop, and no branch.
    while (parents != 0u) {
        uint bit = uint(findLSB(parents));
        parents &= parents - 1u;
        uvec2 parent = uvec2(bit % 4u, bit / 4u);
        if (!varies(level + 1u, first / 2u + parent)) continue;
        for (uint c = 0u; c < 4u; c++) {
            uvec2 at = 2u * parent + uvec2(c & 1u, c >> 1u);
            if (is_lit(level, first + at)) mask |= 1u << (8u * at.y + at.x);
        }
    }
    masks[half_tile] = mask & ~first_masks[half_tile]; // lone pixels are lit already
}
