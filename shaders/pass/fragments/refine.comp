// Children of fragments over which light changes too much: a word for each fragment of the list that is
// no pixel.
#include "kernel/all_channels.h"
#include "pass/fragments/tiles.glsl"

layout(binding = BD_UNIT_BLOCK_FLAGS) uniform usampler2D flags;
layout(binding = BD_UNIT_FINE) uniform sampler2D light;
layout(binding = BD_UNIT_FINE_VECTOR) uniform sampler2D vectors; // a = the spread of light
layout(std430, binding = BD_STORAGE_FRAGMENT_PARENTS) readonly buffer parent_block { uint parents[]; };
layout(std430, binding = BD_STORAGE_FIRST_MASKS) readonly buffer first_mask_block { uint first_masks[]; };
layout(std430, binding = BD_STORAGE_FRAGMENT_MASKS) writeonly buffer mask_block { uint masks[]; };

bool is_first(uint level, uvec2 block)
{
    return (first_masks[half_tile_of(level, block)] >> bit_of(block) & 1u) != 0u;
}

void main()
{
    uint word = item_index();
    if (word >= args.end_item) return;
    uint parent = parents[word], level = BD_FRAGMENT_LEVEL(parent), children = 0u;
    uvec2 block = uvec2(BD_FRAGMENT_X(parent), BD_FRAGMENT_Y(parent));
    ivec2 at = multires_texel(args.multires.levels[level], block);
    if (texelFetch(vectors, at, 0).a > args.spread_threshold * all_channels(texelFetch(light, at, 0).rgb))
        children = BD_BLOCK_CHILDREN(texelFetch(flags, at, 0).x);
    // Lone pixels are lit already.
    for (uint left = children; left != 0u; left &= left - 1u) {
        uint i = uint(findLSB(left));
        if (is_first(level - 1u, 2u * block + uvec2(i & 1u, i >> 1u))) children &= ~(1u << i);
    }
    masks[word] = children;
}
