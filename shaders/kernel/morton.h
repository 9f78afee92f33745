// Morton order: the bits of x and y interleaved, x lowest.
#ifndef BD_KERNEL_MORTON_H
#define BD_KERNEL_MORTON_H

#include "kernel/math.h"

// x of a place; y of the place shifted right by one.
KERNEL uint every_second_bit(uint place)
{
    uint bits = place & 0x55555555u;
    bits = (bits | bits >> 1) & 0x33333333u;
    bits = (bits | bits >> 2) & 0x0f0f0f0fu;
    bits = (bits | bits >> 4) & 0x00ff00ffu;
    return (bits | bits >> 8) & 0x0000ffffu;
}

#endif
