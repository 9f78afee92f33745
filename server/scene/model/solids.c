// Which of several solids is where they overlap: the smallest.

#include <math.h>
#include <stddef.h>

#include "scene/model/scene.h"

double bd_solid_size_m2(const struct bd_instance *instance, const struct bd_primitive *primitive)
{
    double size_m2 = 0;
    for (int k = 0; k < 3; k++) {
        const double *column = instance->world_from_mesh.m + 4 * (size_t)k;
        const double extent = (double)primitive->bounds_max[k] - primitive->bounds_min[k];
        for (int row = 0; row < 3; row++) size_m2 += extent * extent * column[row] * column[row];
    }
    return size_m2;
}

// Of the box's size, or rounding would put what lies on its sides outside.
#define BOX_MARGIN 1e-4

bool bd_solid_box_holds(const struct bd_instance *instance, const struct bd_primitive *primitive,
                        bd_dvec3 world)
{
    const double margin_m = BOX_MARGIN * sqrt(bd_solid_size_m2(instance, primitive));
    const double at[3] = {world.x, world.y, world.z};
    const double *m = instance->world_from_mesh.m;
    for (int row = 0; row < 3; row++) {
        double least = m[12 + row], most = m[12 + row];
        for (int k = 0; k < 3; k++) {
            const double a = m[4 * k + row] * (double)primitive->bounds_min[k];
            const double b = m[4 * k + row] * (double)primitive->bounds_max[k];
            least += fmin(a, b);
            most += fmax(a, b);
        }
        if (!(at[row] >= least - margin_m && at[row] <= most + margin_m)) return false;
    }
    return true;
}
