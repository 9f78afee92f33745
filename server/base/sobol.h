// Sobol's first two dimensions, by the bits of numbers.
//
// Sobol 1967. Thread: any.

#ifndef BD_BASE_SOBOL_H
#define BD_BASE_SOBOL_H

#include <stdint.h>

// The last bit first: of an index the first dimension, as a fraction of 2^32.
static inline uint32_t bd_bits_turned(uint32_t x)
{
    x = __builtin_bswap32(x);
    x = (x & 0x0f0f0f0fu) << 4 | (x & 0xf0f0f0f0u) >> 4;
    x = (x & 0x33333333u) << 2 | (x & 0xccccccccu) >> 2;
    return (x & 0x55555555u) << 1 | (x & 0xaaaaaaaau) >> 1;
}

// Of an index the second dimension, bits turned round. Its k-th direction number is the polynomial
// (1 + x)^k over the field of two elements, so the whole is a substitution of x + 1 for x, by
// halves.
static inline uint32_t bd_sobol_second_turned(uint32_t index)
{
    index ^= index >> 16;
    index ^= (index & 0xff00ff00u) >> 8;
    index ^= (index & 0xf0f0f0f0u) >> 4;
    index ^= (index & 0xccccccccu) >> 2;
    return index ^ (index & 0xaaaaaaaau) >> 1;
}

#endif
