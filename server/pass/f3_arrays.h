// Vectors as they lie in arrays: of lanes side by side, and in vec4s. Kernels know no memory, so
// loops and passes load and store by these. Private to pass/.

#ifndef BD_PASS_F3_ARRAYS_H
#define BD_PASS_F3_ARRAYS_H

#include <stddef.h>

#include "kernel/math.h"
#include "shared/receivers.h"
#include "shared/types.h"

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

static inline f3 f3_loaded(const float from[3])
{
    return f3_of(from[0], from[1], from[2]);
}

static inline void f3_store(float to[3], f3 v)
{
    to[0] = v.x;
    to[1] = v.y;
    to[2] = v.z;
}

#endif
