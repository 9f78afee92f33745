#include "scene/model/primitive.h"

#include <stdlib.h>
#include <string.h>

static bool copy_stream(const void *from, size_t count, size_t item_bytes, void **out)
{
    if (!from) return true;
    *out = malloc(count ? count * item_bytes : 1);
    if (*out && count) memcpy(*out, from, count * item_bytes);
    return *out != NULL;
}

bool bd_primitive_copy(const struct bd_primitive *from, struct bd_primitive *to)
{
    const size_t count = from->vertex_count, vec2 = 2 * sizeof(float), vec3 = 3 * sizeof(float),
                 vec4 = 4 * sizeof(float);
    *to = (struct bd_primitive){.vertex_count = from->vertex_count,
                                .index_count = from->index_count,
                                .material = from->material};
    return copy_stream(from->position, count, vec3, (void **)&to->position) &&
           copy_stream(from->normal, count, vec3, (void **)&to->normal) &&
           copy_stream(from->tangent, count, vec4, (void **)&to->tangent) &&
           copy_stream(from->uv[0], count, vec2, (void **)&to->uv[0]) &&
           copy_stream(from->uv[1], count, vec2, (void **)&to->uv[1]) &&
           copy_stream(from->color, count, vec4, (void **)&to->color) &&
           copy_stream(from->index, from->index_count, sizeof *from->index, (void **)&to->index);
}

void bd_primitive_free_streams(struct bd_primitive *primitive)
{
    free(primitive->position);
    free(primitive->normal);
    free(primitive->tangent);
    free(primitive->uv[0]);
    free(primitive->uv[1]);
    free(primitive->color);
    free(primitive->index);
}

uint32_t bd_primitive_mark_used(const struct bd_primitive *primitive, bool *used)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < primitive->index_count; i++) {
        count += !used[primitive->index[i]];
        used[primitive->index[i]] = true;
    }
    return count;
}

static void close_gaps(float *stream, uint32_t width, const bool *used, uint32_t vertex_count)
{
    uint32_t next = 0;
    for (uint32_t v = 0; stream && v < vertex_count; v++)
        if (used[v])
            memmove(stream + (size_t)width * next++, stream + (size_t)width * v,
                    width * sizeof *stream);
}

static void renumber(struct bd_primitive *primitive, const bool *used, uint32_t *renumbered)
{
    uint32_t next = 0;
    for (uint32_t v = 0; v < primitive->vertex_count; v++) {
        renumbered[v] = next;
        next += used[v];
    }
    for (uint32_t i = 0; i < primitive->index_count; i++)
        primitive->index[i] = renumbered[primitive->index[i]];
}

bool bd_primitive_drop_unused(struct bd_primitive *primitive)
{
    const uint32_t count = primitive->vertex_count;
    bool *used = calloc(count + (size_t)1, sizeof *used);
    uint32_t *renumbered = malloc((count + (size_t)1) * sizeof *renumbered);
    const bool ok = used && renumbered;
    uint32_t kept = ok ? bd_primitive_mark_used(primitive, used) : count;
    if (ok && kept < count) {
        renumber(primitive, used, renumbered);
        close_gaps(primitive->position, 3, used, count);
        close_gaps(primitive->normal, 3, used, count);
        close_gaps(primitive->tangent, 4, used, count);
        close_gaps(primitive->uv[0], 2, used, count);
        close_gaps(primitive->uv[1], 2, used, count);
        close_gaps(primitive->color, 4, used, count);
        primitive->vertex_count = kept;
    }
    free(renumbered);
    free(used);
    return ok;
}

static bool points_to_the_rear(const struct bd_primitive *primitive, const uint32_t corner[3])
{
    bd_dvec3 p[3];
    for (int c = 0; c < 3; c++) {
        const float *at = primitive->position + 3 * (size_t)corner[c];
        p[c] = (bd_dvec3){at[0], at[1], at[2]};
    }
    const bd_dvec3 front = bd_dvec3_cross(bd_dvec3_sub(p[1], p[0]), bd_dvec3_sub(p[2], p[0]));
    for (int c = 0; c < 3; c++) {
        const float *n = primitive->normal + 3 * (size_t)corner[c];
        if (!(bd_dvec3_dot(front, (bd_dvec3){n[0], n[1], n[2]}) < 0)) return false;
    }
    return true;
}

uint32_t bd_primitive_count_against_winding(const struct bd_primitive *primitive)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < primitive->index_count; i += 3)
        count += points_to_the_rear(primitive, primitive->index + i);
    return count;
}

uint32_t bd_mesh_count_against_winding(const struct bd_mesh *mesh)
{
    uint32_t count = 0;
    for (uint32_t p = 0; p < mesh->primitive_count; p++)
        count += bd_primitive_count_against_winding(&mesh->primitives[p]);
    return count;
}
