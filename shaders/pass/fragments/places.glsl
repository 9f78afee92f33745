// Places in the list, from the finished prefix sum.
#include "pass/fragments/runs.glsl"

layout(std430, binding = BD_STORAGE_FRAGMENT_SCAN) readonly buffer scan_block { uint sums[]; };

// Number of fragments in the tiles before this one.
uint fragments_before(uint tile)
{
    uint sum = 0u, first = 0u, count = args.total.x;
    do {
        sum += sums[first + tile];
        tile /= BD_FRAGMENT_SCAN_RUN;
        first += count;
        count = runs_of(count);
    } while (count > 1u);
    return sum;
}

uint fragment_count()
{
    uint first = 0u, count = args.total.x;
    do {
        first += count;
        count = runs_of(count);
    } while (count > 1u);
    return sums[first];
}
