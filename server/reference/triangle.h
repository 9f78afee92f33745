// What the tracer and the shading ask of a triangle that a ray met: worked out once for all, the
// shape in double precision, and kept in two neighbouring lines of the cache. Where a vertex's data
// lie scattered, the wait for them is what an intersection costs.
//
// Private to reference/. Made on one thread, then read by all.

#ifndef BD_REFERENCE_TRIANGLE_H
#define BD_REFERENCE_TRIANGLE_H

#include <math.h>
#include <stdalign.h>
#include <stdbool.h>

#include "reference/shading_vertex.h"
#include "reference/vec3f.h"

// A scene's diagonal is 1 to 2. More than this would be seen.
#define BD_CLEARANCE_MAX 1e-4f

// Reference space.
struct bd_triangle {
    alignas(64) float corner[3][3];
    float normal[3];   // unit, glTF's front; zero if the triangle has no area
    float uncertainty; // how far off it a ray must start for the triangle's shape alone
    float least[3];    // of each barycentric: points of it are no nearer to an edge
    alignas(64) struct bd_shading_vertex shading[3];
};

// Beside a triangle whose material has a normal map.
struct bd_triangle_tangents {
    struct bd_shading_tangent corner[3];
};

// Without `shading`. `mirrored`: the corners run the wrong way round, since the instance is a
// mirror image.
struct bd_triangle bd_triangle_of(const float a[3], const float b[3], const float c[3],
                                  bool mirrored);

// The point at Embree's barycentrics, and how far off the triangle a ray must start there that is
// not to meet it, or its neighbours in the same plane, again.
//
// From the corners, not from the ray's length, which is less exact.
static inline void bd_triangle_point(const struct bd_triangle *triangle, float u, float v,
                                     float position[3], float *clearance)
{
    const float(*p)[3] = triangle->corner;
    double share[3] = {1.0 - u - v, u, v}, sum = 0;
    for (int c = 0; c < 3; c++) share[c] = fmax(share[c], triangle->least[c]), sum += share[c];
    const double s = share[1] / sum, t = share[2] / sum;
    for (int k = 0; k < 3; k++)
        position[k] =
            (float)(p[0][k] + s * ((double)p[1][k] - p[0][k]) + t * ((double)p[2][k] - p[0][k]));
    // The rounding of the position, and of what Embree computes from it.
    float largest = bd_maxf(fabsf(position[0]), bd_maxf(fabsf(position[1]), fabsf(position[2])));
    float rounding = 0x1p-21f * (largest + 0.5f);
    *clearance = bd_minf(rounding + triangle->uncertainty, BD_CLEARANCE_MAX);
}

#endif
