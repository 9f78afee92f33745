// Writes the children of one fragment to their places in the list, and into the mask of blocks.
#include "pass/fragments/places.glsl"

layout(std430, binding = BD_STORAGE_FRAGMENT_PARENTS) readonly buffer parent_block { uint parents[]; };
layout(std430, binding = BD_STORAGE_BLOCK_MASKS) buffer block_mask_block { uint block_masks[]; };
layout(std430, binding = BD_STORAGE_FRAGMENT_LIST) writeonly buffer list_block { uint list[]; };

void main()
{
    uint word = item_index();
    if (word >= args.end_item) return;
    uint left = masks[word], place = left != 0u ? fragments_before(word) : 0u;
    uint parent = parents[word], level = BD_FRAGMENT_LEVEL(parent) - 1u;
    uvec2 first = 2u * uvec2(BD_FRAGMENT_X(parent), BD_FRAGMENT_Y(parent));
    for (; left != 0u; left &= left - 1u) {
        uint i = uint(findLSB(left));
        uvec2 block = first + uvec2(i & 1u, i >> 1u);
        list[place++] = BD_FRAGMENT_PACK(level, block.x, block.y);
        atomicOr(block_masks[half_tile_of(level, block)], 1u << bit_of(block));
    }
}
