// Which points of clusters are drawn for a place, by what clusters may give it (algorithms.md A4,
// I1): whole numbers decide, so that they are the same in any order of threads.
#ifndef BD_KERNEL_POINT_DRAWS_H
#define BD_KERNEL_POINT_DRAWS_H

#include "kernel/stirred.h"

// Of a cluster, of its importance: the largest has MOST_SHARE, and sums of 1,024 stay below 2^32.
#define MOST_SHARE 2097152u // 2^21
KERNEL uint share_of(float importance, float most)
{
    return u_select(most > 0.0f, u_of(f_of(MOST_SHARE) * (importance / f_max(most, 1e-37f))), 0u);
}

// One part in so many is for all clusters alike, so that none is never looked at. `sum`: of shares
// by importance.
#define ALIKE_PARTS 10u
KERNEL uint alike_of(uint sum, uint clusters)
{
    return sum / ALIKE_PARTS / clusters + 1u;
}

KERNEL uint share_with_alike(uint share, uint alike)
{
    return share + alike - share / ALIKE_PARTS;
}

// Of `drawn` points those before the end of the clusters that have `passed` of all shares; `step`
// drawn over the sum of shares, `start` in [0, 1) where the first step begins.
KERNEL uint drawn_before(uint passed, float step, float start, uint drawn)
{
    return u_of(f_min(f_of(passed) * step + start, f_of(drawn)));
}

// Of a place's chance, what counts are drawn by.
KERNEL uint chance_of_counts(uint chance)
{
    return chance ^ 0x6578706cu;
}

// Points of a cluster in even steps: `from` and `step` in points behind the first.
STRUCT(point_steps)
{
    uint first, last, count;
    float from, step;
};

// The first is drawn. Where all are taken nothing is left to be drawn, or to be rounded.
KERNEL point_steps steps_of_cluster(uint first, uint points, uint wanted, uint chance)
{
    point_steps steps;
    steps.first = first;
    steps.last = first + points - 1u;
    steps.count = u_select(wanted < points, wanted, points);
    steps.step = f_of(points) / f_of(steps.count);
    float drawn = part_of_one(stirred(chance ^ first * 0x9e3779b9u));
    steps.from = f_select(wanted < points, drawn * steps.step, 0.0f);
    return steps;
}

KERNEL uint point_of_step(point_steps steps, uint i)
{
    uint to = steps.first + u_of(steps.from + f_of(i) * steps.step);
    return u_select(to < steps.last, to, steps.last);
}

#endif
