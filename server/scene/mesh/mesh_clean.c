// Which triangles stay.

#include <float.h>
#include <math.h>
#include <string.h>

#include "scene/mesh/mesh.h"

static bool is_usable(const float position[3])
{
    const float most = (float)BD_COORDINATE_MAX_M;
    return fabsf(position[0]) <= most && fabsf(position[1]) <= most && fabsf(position[2]) <= most;
}

static double diagonal2(const struct bd_primitive *primitive)
{
    double sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        float least = FLT_MAX, most = -FLT_MAX;
        for (uint32_t v = 0; v < primitive->vertex_count; v++) {
            const float *p = primitive->position + 3 * (size_t)v;
            if (!is_usable(p)) continue;
            least = fminf(least, p[axis]);
            most = fmaxf(most, p[axis]);
        }
        if (most > least) sum += ((double)most - least) * ((double)most - least);
    }
    return sum;
}

static double doubled_area(const struct bd_primitive *primitive, const uint32_t corner[3])
{
    bd_dvec3 p[3];
    for (int c = 0; c < 3; c++) {
        const float *at = primitive->position + 3 * (size_t)corner[c];
        p[c] = (bd_dvec3){at[0], at[1], at[2]};
    }
    return bd_dvec3_length(bd_dvec3_cross(bd_dvec3_sub(p[1], p[0]), bd_dvec3_sub(p[2], p[0])));
}

// Vertices that are not finite become the origin once no triangle uses them: no stream of a scene
// holds a NaN.
static void zero_unusable(struct bd_primitive *primitive, struct bd_mesh_repairs *repairs)
{
    for (uint32_t v = 0; v < primitive->vertex_count; v++) {
        float *p = primitive->position + 3 * (size_t)v;
        if (is_usable(p)) continue;
        memset(p, 0, 3 * sizeof *p);
        repairs->nonfinite_vertices++;
    }
}

// Hazard 19: an area below 1e-14 of the square of the primitive's size is rounding.
static double doubled_area_min(const struct bd_primitive *primitive)
{
    return 2e-14 * diagonal2(primitive);
}

static bool corners_are_usable(const struct bd_primitive *primitive, const uint32_t corner[3])
{
    bool usable = true;
    for (int c = 0; c < 3; c++) usable &= is_usable(primitive->position + 3 * (size_t)corner[c]);
    return usable;
}

uint32_t bd_mesh_count_unclean(const struct bd_primitive *primitive)
{
    double least = doubled_area_min(primitive);
    uint32_t count = 0;
    for (uint32_t i = 0; i < primitive->index_count; i += 3) {
        const uint32_t *corner = primitive->index + i;
        count +=
            !corners_are_usable(primitive, corner) || !(doubled_area(primitive, corner) > least);
    }
    return count;
}

void bd_mesh_clean_triangles(struct bd_primitive *primitive, struct bd_mesh_repairs *repairs)
{
    double least = doubled_area_min(primitive);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < primitive->index_count; i += 3) {
        const uint32_t *corner = primitive->index + i;
        if (!corners_are_usable(primitive, corner)) continue;
        if (!(doubled_area(primitive, corner) > least)) {
            repairs->degenerate_triangles++;
            continue;
        }
        memmove(primitive->index + kept, corner, 3 * sizeof *corner);
        kept += 3;
    }
    primitive->index_count = kept;
    zero_unusable(primitive, repairs);
}
