#include "reference/triangle.h"

#include <math.h>

#include "base/vec.h"
#include "reference/vec3f.h"

static bd_dvec3 widened(const float p[3])
{
    return (bd_dvec3){p[0], p[1], p[2]};
}

// Points are drawn towards the middle by as much as 32 bits can tell apart, so that one on the edge
// between floor and wall is not behind the wall.
static double drawn_in(double longest)
{
    return longest > 0x1p-20 ? 0x1p-22 / longest : 0.25;
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
        .drawn_in = (float)drawn_in(longest),
    };
    bd_vec3f_copy(t.corner[0], a);
    bd_vec3f_copy(t.corner[1], b);
    bd_vec3f_copy(t.corner[2], c);
    return t;
}
