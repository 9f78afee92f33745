// The list of blocks that is worked through, and the prefix sum over the blocks that it leaves to the
// next one: level 0 has a number for each block, level s + 1 one for each run of level s, up to the
// level with one number, which is the sum of all. Each number is the sum of those before it in its
// run.
#include "common/blocks.glsl"
#include "shared/subsplats.h"

layout(local_size_x = BD_SUBSPLAT_GROUP) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_subsplats_args args; };

uint runs_of(uint count) { return (count + BD_SUBSPLAT_RUN - 1u) / BD_SUBSPLAT_RUN; }

bool is_block(uint level, ivec2 block) { return all(lessThan(block, blocks_of_level(level))); }

// Of a block from level 1 on, those that the picture has.
uint child_count(uint level, ivec2 block)
{
    uint count = 0u;
    for (int i = 0; i < 4; i++)
        count += is_block(level - 1u, 2 * block + ivec2(i & 1, i >> 1)) ? 1u : 0u;
    return count;
}
