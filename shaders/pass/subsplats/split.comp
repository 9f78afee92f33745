// The next list: the children of every block that some VPL wants split, with the mask of those VPLs.
// Blocks whose children find no more room keep their mask: they will be drawn as they are.
#include "pass/subsplats/lists.glsl"

layout(std430, binding = BD_STORAGE_SUBSPLATS) readonly buffer block_block { uint blocks[]; };
layout(std430, binding = BD_STORAGE_SPLIT_MASKS) buffer split_block { uint split_masks[]; };
layout(std430, binding = BD_STORAGE_SUBSPLAT_SCAN) readonly buffer scan_block { uint sums_of[]; };
layout(std430, binding = BD_STORAGE_SUBSPLAT_COUNTS) buffer count_block { bd_subsplats_counts counts; };
layout(std430, binding = BD_STORAGE_NEXT_SUBSPLATS) writeonly buffer next_block { uint next_blocks[]; };
layout(std430, binding = BD_STORAGE_NEXT_MASKS) writeonly buffer next_mask_block { uint next_masks[]; };

// Children of the blocks before this one.
uint children_before(uint at)
{
    uint sum = 0u, first = 0u, count = args.list_block_count;
    do {
        sum += sums_of[first + at];
        at /= BD_SUBSPLAT_RUN;
        first += count;
        count = runs_of(count);
    } while (count > 1u);
    return sum;
}

void write_children(uint at, uint level, ivec2 block, uint place)
{
    for (int i = 0; i < 4; i++) {
        ivec2 child = 2 * block + ivec2(i & 1, i >> 1);
        if (!is_block(level - 1u, child)) continue;
        next_blocks[place] = BD_FRAGMENT_PACK(level - 1u, uint(child.x), uint(child.y));
        for (uint word = 0u; word < BD_SUBSPLAT_WORDS; word++)
            next_masks[place * BD_SUBSPLAT_WORDS + word] =
                split_masks[at * BD_SUBSPLAT_WORDS + word];
        place++;
    }
}

void main()
{
    uint at = gl_GlobalInvocationID.x;
    if (at >= args.list_block_count) return;
    uint any_split = 0u;
    for (uint word = 0u; word < BD_SUBSPLAT_WORDS; word++)
        any_split |= split_masks[at * BD_SUBSPLAT_WORDS + word];
    if (any_split == 0u) return;
    uint code = blocks[args.list_first_block + at], level = BD_FRAGMENT_LEVEL(code);
    ivec2 block = ivec2(BD_FRAGMENT_X(code), BD_FRAGMENT_Y(code));
    uint place = children_before(at), end = place + child_count(level, block);
    if (end > args.next_block_count_max) {
        if (place <= args.next_block_count_max) counts.next_fitting = place; // of one block only: places do not shrink
        return;
    }
    write_children(at, level, block, place);
    for (uint word = 0u; word < BD_SUBSPLAT_WORDS; word++)
        split_masks[at * BD_SUBSPLAT_WORDS + word] = 0u;
}
