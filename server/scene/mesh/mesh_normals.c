// Normals: flat ones made, broken ones mended.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/mesh/mesh.h"

static bd_dvec3 vertex(const struct bd_primitive *primitive, uint32_t v)
{
    const float *p = primitive->position + 3 * (size_t)v;
    return (bd_dvec3){p[0], p[1], p[2]};
}

// Twice the triangle's area long, counter-clockwise side up.
static bd_dvec3 area_normal(const struct bd_primitive *primitive, const uint32_t *corner)
{
    bd_dvec3 a = vertex(primitive, corner[0]);
    return bd_dvec3_cross(bd_dvec3_sub(vertex(primitive, corner[1]), a),
                          bd_dvec3_sub(vertex(primitive, corner[2]), a));
}

static bool unshare(float **stream, const uint32_t *index, uint32_t index_count, uint32_t width)
{
    if (!*stream) return true;
    float *own = malloc((index_count ? (size_t)index_count * width : 1) * sizeof *own);
    if (!own) return false;
    for (size_t i = 0; i < index_count; i++)
        memcpy(own + i * width, *stream + (size_t)index[i] * width, width * sizeof *own);
    free(*stream);
    *stream = own;
    return true;
}

bool bd_mesh_flat_normals(struct bd_primitive *primitive)
{
    uint32_t count = primitive->index_count;
    const uint32_t *index = primitive->index;
    if (!unshare(&primitive->position, index, count, 3) ||
        !unshare(&primitive->uv[0], index, count, 2) ||
        !unshare(&primitive->uv[1], index, count, 2) ||
        !unshare(&primitive->color, index, count, 4))
        return false;
    primitive->normal = malloc((count ? 3 * (size_t)count : 1) * sizeof *primitive->normal);
    if (!primitive->normal) return false;
    primitive->vertex_count = count;
    for (uint32_t i = 0; i < count; i++) primitive->index[i] = i;
    for (uint32_t i = 0; i < count; i += 3) {
        bd_dvec3 n =
            bd_dvec3_normalize(area_normal(primitive, primitive->index + i), (bd_dvec3){0, 0, 1});
        for (uint32_t c = 0; c < 3; c++) {
            float *out = primitive->normal + 3 * (size_t)(i + c);
            out[0] = (float)n.x;
            out[1] = (float)n.y;
            out[2] = (float)n.z;
        }
    }
    return true;
}

// Normalises in place. False if nothing can be made of it. What is unit as far as three floats can
// be stays as it is: dividing it again would only turn last bits to and fro, and an import of what
// was imported once would not be the same.
static bool normalize(float n[3], bool *was_unit)
{
    const double tolerance = 0.02; // what 8-bit normals miss by
    double length = sqrt((double)n[0] * n[0] + (double)n[1] * n[1] + (double)n[2] * n[2]);
    if (!(length > 1e-12) || !isfinite(length)) return false;
    *was_unit = fabs(length - 1) < tolerance;
    if (fabs(length - 1) <= BD_UNIT_ROUNDING) return true;
    for (int i = 0; i < 3; i++) n[i] = (float)(n[i] / length);
    return true;
}

static void set_from_triangles(struct bd_primitive *primitive, const bool *broken)
{
    for (uint32_t v = 0; v < primitive->vertex_count; v++)
        if (broken[v]) memset(primitive->normal + 3 * (size_t)v, 0, 3 * sizeof(float));
    for (uint32_t i = 0; i < primitive->index_count; i += 3) {
        bd_dvec3 n =
            bd_dvec3_normalize(area_normal(primitive, primitive->index + i), (bd_dvec3){0, 0, 1});
        for (int c = 0; c < 3; c++) {
            uint32_t v = primitive->index[i + (uint32_t)c];
            if (!broken[v]) continue;
            float *sum = primitive->normal + 3 * (size_t)v;
            sum[0] += (float)n.x;
            sum[1] += (float)n.y;
            sum[2] += (float)n.z;
        }
    }
    for (uint32_t v = 0; v < primitive->vertex_count; v++) {
        float *n = primitive->normal + 3 * (size_t)v;
        bool was_unit;
        if (!broken[v] || normalize(n, &was_unit)) continue;
        n[0] = n[1] = 0; // no triangle, or opposite ones
        n[2] = 1;
    }
}

bool bd_mesh_repair_normals(struct bd_primitive *primitive, struct bd_mesh_repairs *repairs)
{
    bool *broken = calloc(primitive->vertex_count + (size_t)1, sizeof *broken);
    if (!broken) return false;
    bool any = false;
    for (uint32_t v = 0; v < primitive->vertex_count; v++) {
        bool was_unit = true;
        broken[v] = !normalize(primitive->normal + 3 * (size_t)v, &was_unit);
        any |= broken[v];
        repairs->repaired_normals += broken[v] || !was_unit;
    }
    if (any) set_from_triangles(primitive, broken);
    free(broken);
    return true;
}
