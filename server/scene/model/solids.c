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

// Of the box along an axis, or rounding would put what lies on its sides outside.
#define BOX_MARGIN 1e-4
#define BOX_LEAST  1e-6 // of its place

struct box {
    double least[3], most[3];
};

static struct box box_of(const struct bd_mesh *mesh)
{
    struct box box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (uint32_t p = 0; p < mesh->primitive_count; p++)
        for (int k = 0; k < 3; k++) {
            box.least[k] = fmin(box.least[k], mesh->primitives[p].bounds_min[k]);
            box.most[k] = fmax(box.most[k], mesh->primitives[p].bounds_max[k]);
        }
    return box;
}

bool bd_solid_box_holds(const struct bd_scene *scene, const struct bd_instance *instance,
                        bd_dvec3 world)
{
    const struct box box = box_of(scene->meshes[instance->mesh]);
    const double at[3] = {world.x, world.y, world.z}, *m = instance->world_from_mesh.m;
    bool holds = true;
    for (int row = 0; row < 3; row++) {
        double least = m[12 + row], most = m[12 + row];
        for (int k = 0; k < 3; k++) {
            const double a = m[4 * k + row] * box.least[k], b = m[4 * k + row] * box.most[k];
            least += fmin(a, b);
            most += fmax(a, b);
        }
        const double margin = BOX_MARGIN * (most - least) + BOX_LEAST * fabs(at[row]);
        holds &= at[row] >= least - margin && at[row] <= most + margin;
    }
    return holds;
}
