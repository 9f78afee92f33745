// One level of the prefix sum: each invocation adds up one run.
#include "pass/subsplats/lists.glsl"

layout(std430, binding = BD_STORAGE_SUBSPLAT_SCAN) buffer scan_block { uint sums_of[]; };
layout(std430, binding = BD_STORAGE_SUBSPLAT_COUNTS) buffer count_block { bd_subsplats_counts counts; };

void main()
{
    uint run = gl_GlobalInvocationID.x, first = 0u, count = args.list_block_count;
    for (uint level = 0u; level < args.scan_level; level++) {
        first += count;
        count = runs_of(count);
    }
    uint begin = run * BD_SUBSPLAT_RUN, end = min(begin + BD_SUBSPLAT_RUN, count);
    if (begin >= count) return;
    uint sum = 0u;
    for (uint i = begin; i < end; i++) {
        uint own = sums_of[first + i];
        sums_of[first + i] = sum;
        sum += own;
    }
    sums_of[first + count + run] = sum;
    // The last level's one run is all; all of it fits until a block finds otherwise.
    if (count <= BD_SUBSPLAT_RUN) {
        counts.next_wanted = sum;
        counts.next_fitting = min(sum, args.next_block_count_max);
    }
}
