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

// Points of a cluster, one after the other, round and round in its own steps: of more, fewer are
// the first, so that one more changes none of the others. `at`: the first's place in the cluster.
STRUCT(point_steps)
{
    uint first, points, at, step, count;
    float part; // of the cluster that each stands for, in points
};

// By the cluster's name and the place's chance. Where all are taken none is left to be drawn, and
// products of steps have 32 bits.
KERNEL point_steps steps_of_cluster(uint first, uint points, uint name, uint step, uint wanted,
                                    uint chance)
{
    uint drawn = u_of(part_of_one(stirred(chance ^ name)) * f_of(points));
    bool is_all = wanted >= points;
    point_steps steps;
    steps.first = first;
    steps.points = points;
    steps.at = u_select(is_all, 0u, u_select(drawn < points, drawn, points - 1u));
    steps.step = u_select(is_all, 1u, step);
    steps.count = u_select(is_all, points, wanted);
    steps.part = f_of(points) / f_of(steps.count);
    return steps;
}

// The place after that one, and the one after so many.
KERNEL uint next_place(point_steps steps, uint at)
{
    uint next = at + steps.step;
    return u_select(next < steps.points, next, next - steps.points);
}
KERNEL uint place_after(point_steps steps, uint i)
{
    return (steps.at + i * steps.step) % steps.points;
}

#endif
