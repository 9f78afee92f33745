// Numbers that look as if drawn by chance, of numbers: a permutation of 32 bits (Wellons 2018).
#ifndef BD_KERNEL_STIRRED_H
#define BD_KERNEL_STIRRED_H

#include "kernel/math.h"

KERNEL uint stirred(uint x)
{
    x ^= x >> 16u;
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    return x ^ x >> 16u;
}

// In [0, 1), of the upper 24 bits.
KERNEL float part_of_one(uint bits)
{
    return f_of(bits >> 8u) * 5.9604644775390625e-08f;
}

#endif
