// Whether two points of the picture lie on one surface, so that light at one may stand for light at
// the other. By angles alone: nothing in it is a length.
#include "common/gbuffer.glsl"

// Tangent of the angle to a surface's plane under which its other parts are seen, and chord between
// two of its normals.
const float ONE_SURFACE_SLOPE = .25;
const float ONE_SURFACE_CHORD = .4;

// Either normal may tell more than there is: the geometric one on smooth-shaded facets, the shading
// one under a normal map.
bool is_one_surface(receiver a, receiver b)
{
    vec3 across = b.relative_position - a.relative_position;
    float chord = min(distance(a.normal, b.normal),
                      distance(a.normal_geometric, b.normal_geometric));
    float height = min(abs(dot(across, a.normal_geometric)), abs(dot(across, b.normal_geometric)));
    return chord <= ONE_SURFACE_CHORD && height <= ONE_SURFACE_SLOPE * length(across);
}
