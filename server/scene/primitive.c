#include "scene/primitive.h"

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
