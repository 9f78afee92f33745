#include "reference/sampler.h"

#include "base/sobol.h"

// Two words at once.
static uint64_t reversed_pair(uint32_t low, uint32_t high)
{
    uint64_t x = __builtin_bswap64((uint64_t)low << 32 | high);
    x = (x & 0x0f0f0f0f0f0f0f0fu) << 4 | (x & 0xf0f0f0f0f0f0f0f0u) >> 4;
    x = (x & 0x3333333333333333u) << 2 | (x & 0xccccccccccccccccu) >> 2;
    return (x & 0x5555555555555555u) << 1 | (x & 0xaaaaaaaaaaaaaaaau) >> 1;
}

// Owen scrambling of a number whose bits are turned round: each bit is flipped by a hash of the
// lower ones.
static uint32_t scrambled(uint32_t x, uint32_t seed)
{
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

static uint32_t mix32(uint32_t x)
{
    x = (x ^ x >> 16) * 0x7feb352du;
    x = (x ^ x >> 15) * 0x846ca68bu;
    return x ^ x >> 16;
}

struct bd_sampler bd_sampler_at(uint64_t seed, uint32_t x, uint32_t y, uint32_t half,
                                uint32_t index)
{
    uint64_t pixel = bd_mix64((uint64_t)y << 32 | x);
    uint64_t key = bd_mix64(bd_mix64(seed ^ pixel) + half);
    return (struct bd_sampler){(uint32_t)(key >> 32), bd_bits_turned(index), index};
}

void bd_sampler_pair_bits(const struct bd_sampler *sampler, uint32_t pair, uint32_t out[2])
{
    uint32_t key = mix32(sampler->key ^ mix32(pair + 0x68bc21ebu));
    uint32_t index = bd_bits_turned(scrambled(sampler->reversed_index, key));
    uint64_t both =
        reversed_pair(scrambled(index, mix32(key + 0x2545f491u)),
                      scrambled(bd_sobol_second_turned(index), mix32(key + 0x9e3779b9u)));
    out[0] = (uint32_t)both;
    out[1] = (uint32_t)(both >> 32);
}
