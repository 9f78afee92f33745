// Lists of points in halves, along the axis in which they reach furthest: what trees and clusters
// of points are made by. A function of the points alone, whose numbers decide where two lie alike.
//
// Cost: three times through the points, in the mean.
//
// Thread: any.

#ifndef BD_LIGHTS_POINT_HALVES_H
#define BD_LIGHTS_POINT_HALVES_H

#include <stdint.h>

#include "kernel/math.h"

// Dividing fewer takes a fraction of a millisecond.
#define BD_POINTS_TO_PAUSE 4096u

struct bd_point_node {
    f3 position, normal;
    uint32_t point : 30, axis : 2;
};

static inline float bd_along(f3 v, uint32_t axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

// Puts the `first_count` that come first along an axis before the others, the first of which is the
// least of those. Returns the axis, 0 to 2. `count` > first_count.
uint32_t bd_point_halves(struct bd_point_node *nodes, uint32_t count, uint32_t first_count);

#endif
