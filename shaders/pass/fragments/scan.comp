// One level of the prefix sum: each invocation adds up one run.
#include "pass/fragments/runs.glsl"

layout(std430, binding = BD_STORAGE_FRAGMENT_MASKS) readonly buffer mask_block { uint masks[]; };
layout(std430, binding = BD_STORAGE_FRAGMENT_SCAN) buffer scan_block { uint sums[]; };

void main()
{
    uint run = item_index();
    if (run >= args.end_item) return;
    uint first = 0u, count = args.number_count;
    for (uint level = 0u; level < args.scan_level; level++) {
        first += count;
        count = runs_of(count);
    }
    uint begin = run * BD_FRAGMENT_SCAN_RUN, end = min(begin + BD_FRAGMENT_SCAN_RUN, count);
    uint sum = 0u;
    for (uint i = begin; i < end; i++) {
        uint own = args.scan_level > 0u ? sums[first + i]
                                     : uint(bitCount(masks[2u * i]) + bitCount(masks[2u * i + 1u]));
        sums[first + i] = sum;
        sum += own;
    }
    sums[first + count + run] = sum;
}
