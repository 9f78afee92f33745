// Places in the list, from the finished prefix sum.
#include "pass/fragments/runs.glsl"

layout(std430, binding = BD_STORAGE_FRAGMENT_MASKS) readonly buffer mask_block { uint masks[]; };
layout(std430, binding = BD_STORAGE_FRAGMENT_SCAN) readonly buffer scan_block { uint sums[]; };

// Number of fragments in the words before this one.
uint fragments_before(uint word)
{
    uint at = word >> 1u, sum = 0u, first = 0u, count = args.number_count;
    do {
        sum += sums[first + at];
        at /= BD_FRAGMENT_SCAN_RUN;
        first += count;
        count = runs_of(count);
    } while (count > 1u);
    return (word & 1u) != 0u ? sum + uint(bitCount(masks[word - 1u])) : sum;
}

uint fragment_count()
{
    uint first = 0u, count = args.number_count;
    do {
        first += count;
        count = runs_of(count);
    } while (count > 1u);
    return sums[first];
}
