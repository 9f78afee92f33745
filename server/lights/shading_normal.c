#include "lights/shading_normal.h"

#include <math.h>
#include <stddef.h>

// Cofactors of the instance's matrix: its inverse transpose but for a factor, of no sign in mirror
// images, since the caller turns normals.
static f3 normal_of_corner(const struct bd_instance *instance, const float normal[3])
{
    const double *m = instance->world_from_mesh.m;
    double turned[3], length2 = 0;
    for (int r = 0; r < 3; r++) {
        const int p = (r + 1) % 3, q = (r + 2) % 3;
        turned[r] = 0;
        for (int c = 0; c < 3; c++) {
            const int d = (c + 1) % 3, e = (c + 2) % 3;
            turned[r] += normal[c] * (m[4 * d + p] * m[4 * e + q] - m[4 * e + p] * m[4 * d + q]);
        }
        length2 += turned[r] * turned[r];
    }
    const double scale = length2 > 0 ? 1 / sqrt(length2) : 0;
    return f3_of((float)(turned[0] * scale), (float)(turned[1] * scale),
                 (float)(turned[2] * scale));
}

f3 bd_shading_normal(const struct bd_surface_hit *hit, const uint32_t index[3], float u, float v,
                     f3 geometric)
{
    const float weight[3] = {1 - u - v, u, v};
    f3 n = f3_of(0, 0, 0);
    for (int c = 0; c < 3; c++) {
        const float *normal = hit->primitive->normal + 3 * (size_t)index[c];
        n = f3_add(n, f3_scale(normal_of_corner(hit->instance, normal), weight[c]));
    }
    const float length = f3_length(n);
    if (!(length > 0)) return geometric;
    return f3_scale(n, (f3_dot(n, geometric) < 0 ? -1 : 1) / length);
}
