// Unit vectors by the octahedral map.
#ifndef BD_KERNEL_OCTAHEDRAL_H
#define BD_KERNEL_OCTAHEDRAL_H

#include "kernel/math.h"

// x and y of the map, in [-1, 1].
KERNEL f3 unit_of_octahedral(float x, float y)
{
    float z = 1.0f - f_abs(x) - f_abs(y);
    float t = f_max(-z, 0.0f);
    return f3_unit(f3_of(x + f_select(x >= 0.0f, -t, t), y + f_select(y >= 0.0f, -t, t), z));
}

#endif
