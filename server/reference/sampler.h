// Random numbers of the reference: Owen-scrambled Sobol points by hashing (Burley 2020, Practical
// Hash-based Owen Scrambling; the hash is Vegdahl's variant of Laine and Karras's).
//
// Dimensions come in pairs. Within a pair, the samples of a pixel are a scrambled (0, 2)-sequence,
// well spread for any count of them; pairs are shuffled against each other, pixels and halves
// share nothing. A number depends on seed, pixel, half, sample and dimension alone.
//
// Any thread; no state but the value.

#ifndef BD_REFERENCE_SAMPLER_H
#define BD_REFERENCE_SAMPLER_H

#include <stdint.h>

struct bd_sampler {
    uint32_t key;            // of seed, pixel and half
    uint32_t reversed_index; // of the sample, bits turned round
    uint32_t index;
};

struct bd_sampler bd_sampler_at(uint64_t seed, uint32_t x, uint32_t y, uint32_t half,
                                uint32_t index);

// Two numbers, uniform over all 32 bits.
void bd_sampler_pair_bits(const struct bd_sampler *sampler, uint32_t pair, uint32_t out[2]);

// Two numbers in [0, 1).
static inline void bd_sampler_pair(const struct bd_sampler *sampler, uint32_t pair, float out[2])
{
    uint32_t bits[2];
    bd_sampler_pair_bits(sampler, pair, bits);
    for (int k = 0; k < 2; k++) out[k] = (float)(bits[k] >> 8) * 0x1p-24f;
}

// Mixes 64 bits into 64 that look random (Steele et al. 2014, splitmix64).
static inline uint64_t bd_mix64(uint64_t x)
{
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

// A number of its own for whatever `salt` names, unrelated to the pairs: for decisions that come
// up any number of times along a path.
static inline uint32_t bd_sampler_hash(const struct bd_sampler *sampler, uint32_t salt)
{
    uint64_t sample = (uint64_t)sampler->key << 32 | sampler->index;
    return (uint32_t)bd_mix64(sample ^ bd_mix64(salt));
}

#endif
