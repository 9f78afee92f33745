#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/gltf_reader.h"

static enum bd_err check_range(struct bd_gltf_reader *reader, const char *path,
                               const struct bd_gltf_primitive *primitive, const uint32_t *list,
                               uint64_t count, uint32_t vertex_count)
{
    static const uint32_t restart[] = {[1] = 0xff, [2] = 0xffff, [4] = 0xffffffff};
    uint32_t bytes =
        bd_gltf_component_bytes(reader->doc->accessors[primitive->indices].component_type);
    for (uint64_t i = 0; i < count; i++) {
        if (list[i] < vertex_count) continue;
        return bd_fault_set(
            reader->fault, BD_ERR_BAD_INPUT, bd_gltf_path("%.100s.indices", path).text,
            "index %llu is %u%s, there are %u vertices", (unsigned long long)i, list[i],
            list[i] == restart[bytes] ? " (primitive restart)" : "", vertex_count);
    }
    return BD_ERR_OK;
}

// The primitive's list of vertices: its indices, or 0, 1, 2 ...
static enum bd_err read_list(struct bd_gltf_reader *reader, const char *path,
                             const struct bd_gltf_primitive *primitive, uint32_t vertex_count,
                             uint32_t **list, uint32_t *count)
{
    bool indexed = primitive->indices != BD_NONE;
    *count = indexed ? (uint32_t)reader->doc->accessors[primitive->indices].count : vertex_count;
    *list = malloc((*count ? (size_t)*count : 1) * sizeof **list);
    if (!*list) return bd_gltf_no_memory(reader, path);
    if (!indexed) {
        for (uint32_t i = 0; i < *count; i++) (*list)[i] = i;
        return BD_ERR_OK;
    }
    enum bd_err err = bd_gltf_read_indices(reader, primitive->indices, *list);
    if (err == BD_ERR_OK) err = check_range(reader, path, primitive, *list, *count, vertex_count);
    if (err != BD_ERR_OK) {
        free(*list);
        *list = NULL;
    }
    return err;
}

// Triangle `t` of a strip or a fan, with the winding that the specification gives.
static void corner_of(int32_t mode, uint32_t t, uint32_t corner[3])
{
    if (mode == 5) {
        corner[0] = t;
        corner[1] = t + 1 + t % 2;
        corner[2] = t + 2 - t % 2;
    } else {
        corner[0] = t + 1;
        corner[1] = t + 2;
        corner[2] = 0;
    }
}

static enum bd_err expand(struct bd_gltf_reader *reader, const char *path, int32_t mode,
                          const uint32_t *list, uint32_t count, uint32_t **index,
                          uint32_t *index_count)
{
    uint32_t triangles = count < 3 ? 0 : count - 2;
    if (triangles > UINT32_MAX / 3) return bd_gltf_no_memory(reader, path);
    *index = malloc((triangles ? 3 * (size_t)triangles : 1) * sizeof **index);
    if (!*index) return bd_gltf_no_memory(reader, path);
    *index_count = 3 * triangles;
    for (uint32_t t = 0; t < triangles; t++) {
        uint32_t corner[3];
        corner_of(mode, t, corner);
        for (int c = 0; c < 3; c++) (*index)[3 * (size_t)t + (size_t)c] = list[corner[c]];
    }
    return BD_ERR_OK;
}

enum bd_err bd_gltf_read_triangles(struct bd_gltf_reader *reader, const char *path,
                                   const struct bd_gltf_primitive *primitive, uint32_t vertex_count,
                                   uint32_t **index, uint32_t *index_count)
{
    uint32_t *list, count;
    enum bd_err err = read_list(reader, path, primitive, vertex_count, &list, &count);
    if (err != BD_ERR_OK) return err;
    if (primitive->mode == 4) {
        reader->repairs.incomplete_triangles += count % 3 != 0;
        *index = list;
        *index_count = count - count % 3;
        return BD_ERR_OK;
    }
    err = expand(reader, path, primitive->mode, list, count, index, index_count);
    free(list);
    return err;
}

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
static void zero_unusable(struct bd_gltf_reader *reader, struct bd_primitive *primitive)
{
    for (uint32_t v = 0; v < primitive->vertex_count; v++) {
        float *p = primitive->position + 3 * (size_t)v;
        if (is_usable(p)) continue;
        memset(p, 0, 3 * sizeof *p);
        reader->repairs.nonfinite_vertices++;
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

uint32_t bd_gltf_count_unclean(const struct bd_primitive *primitive)
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

void bd_gltf_clean_triangles(struct bd_gltf_reader *reader, struct bd_primitive *primitive)
{
    double least = doubled_area_min(primitive);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < primitive->index_count; i += 3) {
        const uint32_t *corner = primitive->index + i;
        if (!corners_are_usable(primitive, corner)) continue;
        if (!(doubled_area(primitive, corner) > least)) {
            reader->repairs.degenerate_triangles++;
            continue;
        }
        memmove(primitive->index + kept, corner, 3 * sizeof *corner);
        kept += 3;
    }
    primitive->index_count = kept;
    zero_unusable(reader, primitive);
}
