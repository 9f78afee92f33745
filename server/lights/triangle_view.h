// A triangle as a point sees it, and directions to it: uniform over the solid angle that it fills,
// so that nothing blows up near it; of one that fills next to nothing, uniform over its area.
//
// Arvo 1995 (stratified sampling of spherical triangles); Van Oosterom and Strackee 1983 (the
// solid angle).
//
// Thread: any.

#ifndef BD_LIGHTS_TRIANGLE_VIEW_H
#define BD_LIGHTS_TRIANGLE_VIEW_H

#include "base/vec.h"
#include "lights/area_lights.h"

struct bd_triangle_view {
    f3 to[3];       // unit, to its corners
    float solid_sr; // 0: it is not seen: degenerate, or through the point
    float above;    // the mean cosine of its corners to a normal, those below the horizon as 0
};

// What all directions that are chosen to one have in common; nothing where it fills next to
// nothing. In double: cosines of angles between directions lose half of their digits.
struct bd_triangle_aim {
    bd_dvec3 a, b, off_a; // unit: to two corners, and from the first along the edge to the third
    double alpha, sin_alpha, cos_alpha; // between the planes that meet in a
    double cos_c;                       // of the edge from a to b
    double area;                        // steradians
};
struct bd_triangle_aim bd_triangle_aim_of(const struct bd_triangle_view *view);

// Of a part, from a point with a normal; without what it hides behind its own back.
struct bd_triangle_view bd_triangle_view_of(const struct bd_area_light *light, bool two_sided,
                                            f3 point, f3 normal);

// What the part may send to the point: 0 only where it sends nothing.
static inline float bd_triangle_view_weight(const struct bd_triangle_view *view,
                                            const struct bd_area_light *light)
{
    return light->brightest * view->solid_sr * view->above;
}

// A point of the part for two numbers in [0, 1): barycentrics of the triangle, where it is, and
// the pdf of its direction, per steradian.
struct bd_triangle_point {
    float u, v;
    f3 position;
    float pdf;
};
bool bd_triangle_view_choose(const struct bd_triangle_view *view, const struct bd_triangle_aim *aim,
                             const struct bd_area_light *light, f3 point, const float number[2],
                             struct bd_triangle_point *out);
// That pdf, of a direction to a point of the part at a distance.
float bd_triangle_view_pdf(const struct bd_triangle_view *view, const struct bd_area_light *light,
                           f3 direction, float distance);

#endif
