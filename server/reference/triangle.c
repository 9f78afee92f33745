#include "reference/triangle.h"

#include <math.h>

#include "base/vec.h"
#include "reference/vec3f.h"

static bd_dvec3 widened(const float p[3])
{
    return (bd_dvec3){p[0], p[1], p[2]};
}

// Points keep that far off edges, of about a scene's size, so that one on the edge between floor
// and wall is before the wall, and rays from there meet it: more than 32 bits can tell apart, and
// in corners of 60 degrees and more enough for what rays start off a fat triangle. In sharper
// corners one path in a million still gets out; 2^-19 would hold for 45 degrees, and loses .4 % of
// the light of a punctual light at the hub of a fan.
#define OFF_EDGE 0x1p-20

// Of the barycentric that is 1 in the corner opposite to an edge.
static float least_share(double edge, double twice_area)
{
    return (float)fmin(OFF_EDGE * edge / fmax(twice_area, 1e-30), 1.0 / 3);
}

// The normal of a needle is less certain than that of a fat triangle, by the ratio of its longest
// edge's square to its area.
static double uncertainty(double longest, double twice_area)
{
    return 0x1p-22 * longest * longest * longest / fmax(twice_area, 1e-30);
}

struct bd_triangle bd_triangle_of(const float a[3], const float b[3], const float c[3],
                                  bool mirrored)
{
    bd_dvec3 ab = bd_dvec3_sub(widened(b), widened(a)), ac = bd_dvec3_sub(widened(c), widened(a));
    bd_dvec3 bc = bd_dvec3_sub(ac, ab), across = bd_dvec3_cross(ab, ac);
    double longest =
        sqrt(fmax(bd_dvec3_dot(ab, ab), fmax(bd_dvec3_dot(ac, ac), bd_dvec3_dot(bc, bc))));
    double twice_area = bd_dvec3_length(across);
    double scale = twice_area > 0 ? (mirrored ? -1 : 1) / twice_area : 0;
    struct bd_triangle t = {
        .normal = {(float)(across.x * scale), (float)(across.y * scale), (float)(across.z * scale)},
        .uncertainty = (float)fmin(uncertainty(longest, twice_area), BD_CLEARANCE_MAX),
        .least = {least_share(bd_dvec3_length(bc), twice_area),
                  least_share(bd_dvec3_length(ac), twice_area),
                  least_share(bd_dvec3_length(ab), twice_area)},
    };
    bd_vec3f_copy(t.corner[0], a);
    bd_vec3f_copy(t.corner[1], b);
    bd_vec3f_copy(t.corner[2], c);
    return t;
}
