// Numbers in [0, 1) that are spread evenly within each pixel, over each square block of pixels of a
// power of two, and in each pair of them: Sobol's first two dimensions, scrambled, pixels in Morton
// order. What neighbours choose differs, so that noise is of high frequencies and a filter of
// few pixels removes it. A function of its arguments alone.
//
// Owen 1995 (scrambling); Laine and Karras 2011, Burley 2020 (by hashing); Ahmed and Wonka 2020
// (over the screen).
//
// Thread: any.

#ifndef BD_LIGHTS_SEQUENCE_H
#define BD_LIGHTS_SEQUENCE_H

#include <stdint.h>

#include "base/sobol.h"
#include "kernel/stirred.h"

// Of all that is chosen by one seed for one purpose.
struct bd_sequence {
    uint32_t order, across, down; // scrambles
};

static inline uint32_t bd_stirred(uint32_t x)
{
    return stirred(x);
}

static inline struct bd_sequence bd_sequence_of(uint32_t seed, uint32_t purpose)
{
    const uint32_t mixed = bd_stirred(seed ^ bd_stirred(purpose + 0x9e3779b9u));
    return (struct bd_sequence){bd_stirred(mixed ^ 0x68bc21ebu), bd_stirred(mixed ^ 0x02e5be93u),
                                bd_stirred(mixed ^ 0x967a889bu)};
}

// Each bit by those below it.
static inline uint32_t bd_scrambled_turned(uint32_t x, uint32_t seed)
{
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    return x ^ x * 0x8d22f6e6u;
}

static inline uint32_t bd_scrambled(uint32_t x, uint32_t seed)
{
    return bd_bits_turned(bd_scrambled_turned(bd_bits_turned(x), seed));
}

static inline uint32_t bd_spaced(uint32_t x)
{
    x &= 0xffffu;
    x = (x | x << 8) & 0x00ff00ffu;
    x = (x | x << 4) & 0x0f0f0f0fu;
    x = (x | x << 2) & 0x33333333u;
    return (x | x << 1) & 0x55555555u;
}

// A power of two that has room for so many numbers: the `stride` below.
static inline uint32_t bd_sequence_stride(uint32_t count)
{
    uint32_t stride = 1;
    while (stride < count) stride *= 2;
    return stride;
}

// The place of a pixel's first number, of `stride` that each has.
static inline uint32_t bd_sequence_place(uint32_t x_px, uint32_t y_px, uint32_t stride)
{
    return (bd_spaced(x_px) | bd_spaced(y_px) << 1) * stride;
}

static inline void bd_sequence_pair(const struct bd_sequence *sequence, uint32_t place,
                                    float out[2])
{
    const uint32_t index = bd_scrambled(place, sequence->order);
    const uint32_t x = bd_bits_turned(bd_scrambled_turned(index, sequence->across));
    const uint32_t y =
        bd_bits_turned(bd_scrambled_turned(bd_sobol_second_turned(index), sequence->down));
    out[0] = (float)(x >> 8) * 0x1p-24f;
    out[1] = (float)(y >> 8) * 0x1p-24f;
}

#endif
