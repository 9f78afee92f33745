#include "pass/fragment_order.h"

#include <stdlib.h>

#include "shared/multires.h"

static uint32_t spread_bits(uint32_t bits)
{
    bits &= 0xffffu;
    bits = (bits | bits << 8) & 0x00ff00ffu;
    bits = (bits | bits << 4) & 0x0f0f0f0fu;
    bits = (bits | bits << 2) & 0x33333333u;
    return (bits | bits << 1) & 0x55555555u;
}

static uint32_t morton_of(uint32_t fragment)
{
    const uint32_t level = BD_FRAGMENT_LEVEL(fragment);
    return spread_bits(BD_FRAGMENT_X(fragment) << level) |
           spread_bits(BD_FRAGMENT_Y(fragment) << level) << 1;
}

static int by_number(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

// Pixels last: nobody splits them, so that a group of them is spared its spread.
static uint64_t key_of(uint32_t fragment)
{
    const uint64_t is_pixel = BD_FRAGMENT_LEVEL(fragment) == 0;
    return is_pixel << 63 | (uint64_t)morton_of(fragment) << 32 | fragment;
}

void bd_fragment_order(uint32_t *fragments, uint64_t *spare, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) spare[i] = key_of(fragments[i]);
    qsort(spare, count, sizeof *spare, by_number);
    for (uint32_t i = 0; i < count; i++) fragments[i] = (uint32_t)spare[i];
}
