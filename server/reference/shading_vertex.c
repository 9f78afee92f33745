#include "reference/shading_vertex.h"

#include <stddef.h>

#include "reference/vec3f.h"

static void transform(const float matrix[9], const float v[3], float out[3])
{
    bd_vec3f_set(out, bd_vec3f_dot(matrix, v), bd_vec3f_dot(matrix + 3, v),
                 bd_vec3f_dot(matrix + 6, v));
    if (!bd_vec3f_normalize(out)) bd_vec3f_set(out, 0, 0, 0);
}

void bd_shading_vertices(const struct bd_primitive *primitive, const float normal_from_mesh[9],
                         const float world_from_mesh[9], bool mirrored,
                         struct bd_shading_vertex *out)
{
    for (size_t i = 0; i < primitive->vertex_count; i++) {
        struct bd_shading_vertex *v = &out[i];
        *v = (struct bd_shading_vertex){0};
        transform(normal_from_mesh, primitive->normal + 3 * i, v->normal);
        if (primitive->tangent) {
            transform(world_from_mesh, primitive->tangent + 4 * i, v->tangent);
            v->handedness = (mirrored ? -1 : 1) * primitive->tangent[4 * i + 3];
        }
        if (!primitive->uv[0]) continue;
        v->uv[0] = primitive->uv[0][2 * i];
        v->uv[1] = primitive->uv[0][2 * i + 1];
    }
}
