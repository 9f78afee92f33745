// What loops over lanes are written with. Private to pass/native/.
//
// Such a loop counts to BD_LANES, calls kernels, and has no branch: the compiler packs it whole
// (tests/native reads the objects). BD_WIDTH is the name of the width that a file is compiled for.

#ifndef BD_PASS_NATIVE_LANES_H
#define BD_PASS_NATIVE_LANES_H

#include <stddef.h>

#include "kernel/math.h"
#include "shared/receivers.h"

#define LANES(i) for (size_t i = 0; i < BD_LANES; i++)

#define JOIN_(a, b) a##_##b
#define JOIN(a, b)  JOIN_(a, b)
#define WIDE(name)  JOIN(name, BD_WIDTH)

static inline f3 f3_at(const struct bd_lanes3 *lanes, size_t i)
{
    return f3_of(lanes->x[i], lanes->y[i], lanes->z[i]);
}

static inline void f3_put_at(struct bd_lanes3 *lanes, size_t i, f3 v)
{
    lanes->x[i] = v.x;
    lanes->y[i] = v.y;
    lanes->z[i] = v.z;
}

static inline void f3_add_at(struct bd_lanes3 *lanes, size_t i, f3 v)
{
    lanes->x[i] += v.x;
    lanes->y[i] += v.y;
    lanes->z[i] += v.z;
}

static inline f3 f3_from(const struct bd_vec4 *v)
{
    return f3_of(v->x, v->y, v->z);
}

#endif
