// How many points of each cluster are drawn, by what it may give (algorithms.md A4, I1).
//
// Systematic sampling: steps of one size through the clusters' shares, so that each has its part of
// all, rounded up or down, in the mean exactly, and all together are as many as are to be drawn. A
// tenth of the shares is alike for all clusters, so that none is never looked at. Shares are whole
// numbers: their sums are the same in any order.
//
// Private to pass/. Thread: any.

#ifndef BD_PASS_POINT_COUNTS_H
#define BD_PASS_POINT_COUNTS_H

#include <stdint.h>

// From what clusters may give, 0 or more; returns their sum. `count`: 1 to BD_CLUSTERS_MAX.
uint32_t bd_point_shares(const float *importance, uint32_t count, uint32_t *shares);

// `sum` that of the shares, `start` in [0, 1) where the first step begins.
void bd_point_counts(const uint32_t *shares, uint32_t count, uint32_t sum, uint32_t drawn,
                     float start, uint32_t *counts);

// As printed: a loop that carries what a cluster was given too much or too little to the next. The
// mean of a cluster's is not its part, and one that gives nothing may have some (I1). `chance`: any
// number.
void bd_point_counts_printed(const float *importance, uint32_t count, uint32_t drawn,
                             uint32_t chance, uint32_t *counts);

#endif
