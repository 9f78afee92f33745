#include "reference/shading_vertex.h"

#include <math.h>
#include <stddef.h>

#include "reference/vec3f.h"

// Linear part and its cofactors (the inverse transpose up to a factor), scaled by a power of two
// so that neither leaves the range of 32 bits.
struct bd_linear bd_linear_of(const bd_dmat4 *m)
{
    struct bd_linear out = {.mirrored = bd_dmat4_determinant3(m) < 0};
    double largest = 0, a[9];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) largest = fmax(largest, fabs(m->m[4 * c + r]));
    int exponent = 0;
    frexp(largest, &exponent);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) a[3 * r + c] = ldexp(m->m[4 * c + r], -exponent);
    for (int r = 0; r < 3; r++) {
        const double *p = a + 3 * ((r + 1) % 3), *q = a + 3 * ((r + 2) % 3);
        for (int c = 0; c < 3; c++) {
            int d = (c + 1) % 3, e = (c + 2) % 3;
            double cofactor = p[d] * q[e] - p[e] * q[d];
            out.normal_from_mesh[3 * r + c] = (float)(out.mirrored ? -cofactor : cofactor);
            out.world_from_mesh[3 * r + c] = (float)a[3 * r + c];
        }
    }
    return out;
}

static void transform(const float matrix[9], const float v[3], float out[3])
{
    bd_vec3f_set(out, bd_vec3f_dot(matrix, v), bd_vec3f_dot(matrix + 3, v),
                 bd_vec3f_dot(matrix + 6, v));
    if (!bd_vec3f_normalize(out)) bd_vec3f_set(out, 0, 0, 0);
}

struct bd_shading_vertex bd_shading_vertex_of(const struct bd_primitive *primitive, uint32_t vertex,
                              const struct bd_linear *linear)
{
    struct bd_shading_vertex corner = {{0, 0, 0}, {0, 0}};
    transform(linear->normal_from_mesh, primitive->normal + 3 * (size_t)vertex, corner.normal);
    if (!primitive->uv[0]) return corner;
    for (size_t k = 0; k < 2; k++) corner.uv[k] = primitive->uv[0][2 * (size_t)vertex + k];
    return corner;
}

struct bd_shading_tangent bd_shading_tangent_of(const struct bd_primitive *primitive, uint32_t vertex,
                                              const struct bd_linear *linear)
{
    const float *from = primitive->tangent + 4 * (size_t)vertex;
    struct bd_shading_tangent corner = {{0, 0, 0}, (linear->mirrored ? -1 : 1) * from[3]};
    transform(linear->world_from_mesh, from, corner.tangent);
    return corner;
}
