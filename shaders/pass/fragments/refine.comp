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

bool is_parent(uint level, uvec2 block)
{
    uvec4 tiles = args.tiles[level];
    uvec2 tile = block / BD_FRAGMENT_TILE_SIDE, inside = block % BD_FRAGMENT_TILE_SIDE;
    uint half_tile = 2u * (tiles.x + tile.y * tiles.y + tile.x) + inside.y / 4u;
    return (parent_masks[half_tile] >> (8u * (inside.y % 4u) + inside.x) & 1u) != 0u;
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
    uint mask = 0u;
    uint parents = level + 1u < args.multires.size_px.z ? 8u : 0u;
    for (uint i = 0u; i < parents; i++) {
        uvec2 in_half = 2u * uvec2(i % 4u, i / 4u), parent = (first + in_half) / 2u;
        if (!multires_has(args.multires.levels[level + 1u], parent)) continue;
        if (!is_parent(level + 1u, parent) || !varies(level + 1u, parent)) continue;
        for (uint c = 0u; c < 4u; c++) {
            uvec2 at = in_half + uvec2(c & 1u, c >> 1u);
            if (is_lit(level, first + at)) mask |= 1u << (8u * at.y + at.x);
        }
    }
    masks[half_tile] = mask & ~first_masks[half_tile]; // lone pixels are lit already
}
