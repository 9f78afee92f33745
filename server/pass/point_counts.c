#include "pass/point_counts.h"

#include "kernel/point_draws.h"
#include "lights/point_clusters.h"

_Static_assert((uint64_t)BD_CLUSTERS_MAX *MOST_SHARE < UINT32_MAX, "sums have room");

uint32_t bd_point_shares(const float *importance, uint32_t count, uint32_t *shares)
{
    float most = 0;
    uint32_t by_importance = 0, sum = 0;
    for (uint32_t k = 0; k < count; k++) most = f_max(most, importance[k]);
    for (uint32_t k = 0; k < count; k++) {
        shares[k] = share_of(importance[k], most);
        by_importance += shares[k];
    }
    const uint32_t alike = alike_of(by_importance, count);
    for (uint32_t k = 0; k < count; k++) {
        shares[k] = share_with_alike(shares[k], alike);
        sum += shares[k];
    }
    return sum;
}

void bd_point_counts(const uint32_t *shares, uint32_t count, uint32_t sum, uint32_t drawn,
                     float start, uint32_t *counts)
{
    const float step = (float)drawn / (float)sum;
    uint32_t passed = 0, before = 0;
    for (uint32_t k = 0; k < count; k++) {
        passed += shares[k];
        const uint32_t beyond = k + 1 == count ? drawn : drawn_before(passed, step, start, drawn);
        counts[k] = beyond - before;
        before = beyond;
    }
}

void bd_point_counts_printed(const float *importance, uint32_t count, uint32_t drawn,
                             uint32_t chance, uint32_t *counts)
{
    float sum = 0, carry = 0;
    for (uint32_t k = 0; k < count; k++) sum += importance[k];
    for (uint32_t k = 0; k < count; k++) {
        const float part = sum > 0 ? importance[k] / sum : 1 / (float)count;
        const float wanted = (float)drawn * part + carry;
        const float number = part_of_one(stirred(chance + k * 0x9e3779b9u));
        counts[k] = (uint32_t)f_max(wanted, 0);
        carry = wanted - (float)counts[k];
        if (number >= carry) continue;
        counts[k]++;
        carry -= 1;
    }
}
