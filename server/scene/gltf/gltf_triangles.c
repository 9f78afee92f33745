// Triangles of a primitive: lists, strips and fans, their indices in range.

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_reader.h"

static enum bd_err check_range(struct bd_gltf_reader *reader, const char *path,
                               const struct bd_gltf_primitive *primitive, const uint32_t *list,
                               uint64_t count, uint32_t vertex_count)
{
    static const uint32_t restart[] = {[1] = 0xff, [2] = 0xffff, [4] = 0xffffffff};
    uint32_t bytes =
        bd_gltf_component_bytes(reader->doc->accessors[primitive->indices].component_type);
    for (uint64_t i = 0; i < count; i++) {
        if (list[i] < vertex_count) continue;
        return bd_err_set(
            reader->detail, BD_ERR_BAD_INPUT, bd_gltf_path("%.100s.indices", path).text,
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
