// The random numbers of the reference.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "reference/sampler.h"
#include "tests/unit/cmocka_all.h"

// Counts of points in the cells of a 2^a x 2^b grid are all one, for every split of 2^m points:
// a (0, m, 2)-net, scrambled.
static void check_net(uint64_t seed, uint32_t pair, uint32_t first, uint32_t m)
{
    for (uint32_t a = 0; a <= m; a++) {
        uint8_t seen[256] = {0};
        for (uint32_t i = 0; i < 1u << m; i++) {
            struct bd_sampler s = bd_sampler_at(seed, 3, 5, 0, first + i);
            uint32_t bits[2];
            bd_sampler_pair_bits(&s, pair, bits);
            uint32_t x = a ? bits[0] >> (32 - a) : 0, y = a < m ? bits[1] >> (32 - (m - a)) : 0;
            assert_int_equal(seen[y << a | x]++, 0);
        }
    }
}

static void pairs_are_nets(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 4; seed++)
        for (uint32_t pair = 0; pair < 20; pair++) {
            check_net(seed, pair, 0, 8);
            check_net(seed, pair, 512, 8);
            check_net(seed, pair, 0, 5);
        }
}

static double correlation(uint32_t pair_a, uint32_t half_b, uint32_t pair_b, uint32_t pixel_b)
{
    const uint32_t count = 4096;
    double sum = 0;
    for (uint32_t i = 0; i < count; i++) {
        struct bd_sampler a = bd_sampler_at(7, 0, 0, 0, i);
        struct bd_sampler b = bd_sampler_at(7, pixel_b, 0, half_b, i);
        float u[2], v[2];
        bd_sampler_pair(&a, pair_a, u);
        bd_sampler_pair(&b, pair_b, v);
        sum += 12 * (u[0] - 0.5) * (v[0] - 0.5);
    }
    return sum / sqrt(count); // standard deviation 1 if independent
}

static void pixels_halves_and_pairs_are_unrelated(void **state)
{
    (void)state;
    for (uint32_t k = 1; k < 50; k++) {
        assert_true(fabs(correlation(0, 1, 0, k - 1)) < 4.5);
        assert_true(fabs(correlation(0, 0, k, 0)) < 4.5);
        assert_true(fabs(correlation(k, 0, k, k)) < 4.5);
    }
}

static void hashes_cover_all_bits(void **state)
{
    (void)state;
    uint32_t ones[32] = {0};
    const uint32_t count = 1 << 14;
    for (uint32_t i = 0; i < count; i++) {
        struct bd_sampler s = bd_sampler_at(1, 2, 3, 1, i >> 3);
        uint32_t h = bd_sampler_hash(&s, i & 7);
        for (int b = 0; b < 32; b++) ones[b] += h >> b & 1;
    }
    for (int b = 0; b < 32; b++)
        assert_true(fabs(ones[b] - 0.5 * count) < 4.5 * 0.5 * sqrt(count));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pairs_are_nets),
        cmocka_unit_test(pixels_halves_and_pairs_are_unrelated),
        cmocka_unit_test(hashes_cover_all_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
