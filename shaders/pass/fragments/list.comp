// Writes the fragments of half a tile to their places in the list.
#include "pass/fragments/places.glsl"

layout(std430, binding = BD_STORAGE_FRAGMENT_LIST) writeonly buffer list_block { uint list[]; };

void main()
{
    uint half_tile = item_index();
    if (half_tile >= args.end_item) return;
    uint mask = masks[half_tile];
    if (mask == 0u) return;
    uint level = level_of_tile(half_tile >> 1u), place = fragments_before(half_tile);
    uvec2 first = first_block(level, half_tile);
    while (mask != 0u) {
        uint bit = uint(findLSB(mask));
        list[place++] = BD_FRAGMENT_PACK(level, first.x + bit % 8u, first.y + bit / 8u);
        mask &= mask - 1u;
    }
}
