// Exact shadows from a map of triangle ids (common/shadow.glsl). A segment goes from `origin` by
// `span` to the light; triangles are a corner and two edges.
#ifndef BD_KERNEL_SHADOW_H
#define BD_KERNEL_SHADOW_H

#include "kernel/math.h"

#define SMALL_TRIANGLE_TEXELS     4.0f
#define SMALL_TRIANGLE_GAP_TEXELS 3.0f

// Off the surface by what 32 bits can tell apart at this place; and towards the light by the error
// of the position itself, which in a corner may lie behind the other wall. `to_light` is unit and
// above the surface; `relative` is the position's to the view.
KERNEL f3 shadow_origin(f3 position, f3 relative, f3 normal_geometric, f3 to_light)
{
    f3 magnitude = f3_add(f3_abs(position), f3_abs(relative));
    float largest = f_max(magnitude.x, f_max(magnitude.y, magnitude.z));
    f3 off = f3_add(f3_scale(normal_geometric, 4e-6f), f3_scale(to_light, 1e-6f));
    return f3_add(position, f3_scale(off, largest));
}

// A texel's coordinate, not yet floored, of what lies `aside` of a face's axis. `reach`: the
// distance ahead, or 1 of a directional light.
KERNEL float shadow_texel_at(float aside, float half_width, float reach, float side_texels)
{
    return (aside / half_width / reach * 0.5f + 0.5f) * side_texels;
}

// The longer side of a texel at a distance from the light (or 1), render units: a directional
// light's frame fits the scene, and its texels need not be square.
KERNEL float shadow_texel_side(float half_width, float half_height, float side_texels,
                               float distance)
{
    return 2.0f * f_max(half_width, half_height) / side_texels * distance;
}

// True if the open segment meets the triangle (Moeller and Trumbore 1997). The edges are widened by
// a few ulps, so that no light passes between neighbours.
KERNEL bool segment_intersects(f3 origin, f3 span, f3 corner, f3 edge1, f3 edge2)
{
    f3 p = f3_cross(span, edge2);
    float determinant = f3_dot(edge1, p);
    float inverse = 1.0f / f_select(determinant == 0.0f, 1.0f, determinant);
    f3 s = f3_sub(origin, corner);
    f3 q = f3_cross(s, edge1);
    float u = f3_dot(s, p) * inverse;
    float v = f3_dot(span, q) * inverse;
    float t = f3_dot(edge2, q) * inverse;
    bool within = b_and(b_and(u >= -2e-6f, v >= -2e-6f), u + v <= 1.0f + 2e-6f);
    return b_and(b_and(within, determinant != 0.0f), b_and(t > 0.0f, t < 1.0f));
}

// Triangles smaller than the map's texels hide each other from it: the one that the segment meets
// may be named nowhere. Where the texel of the receiver itself names one so small, its plane
// stands for the surface that it is part of, as in a plain shadow map; the gap to the receiver
// must then exceed what the surface can turn within a texel or two.
KERNEL bool segment_intersects_small(f3 origin, f3 span, f3 corner, f3 edge1, f3 edge2,
                                float texel_side)
{
    f3 edge3 = f3_sub(edge2, edge1), n = f3_cross(edge1, edge2);
    float longest = f_max(f3_dot(edge1, edge1), f_max(f3_dot(edge2, edge2), f3_dot(edge3, edge3)));
    float most = SMALL_TRIANGLE_TEXELS * SMALL_TRIANGLE_TEXELS * texel_side * texel_side;
    float toward = f3_dot(span, n), length = f3_length(span);
    float t = f3_dot(f3_sub(corner, origin), n) / f_select(toward == 0.0f, 1.0f, toward);
    float cosine = f_abs(toward) / (length * f3_length(n));
    bool is_small = b_and(longest <= most, toward != 0.0f);
    float gap = t * length * f_max(cosine, 0.1f);
    return b_and(b_and(is_small, t < 1.0f), gap > SMALL_TRIANGLE_GAP_TEXELS * texel_side);
}

// Whether a texel that sees this triangle speaks for light at the receiver: it cannot hide one that
// lies in its plane, within a texel, or on its lit side.
KERNEL bool triangle_leaves_open(f3 origin, f3 span, f3 corner, f3 edge1, f3 edge2,
                                 float texel_side)
{
    f3 n = f3_cross(edge1, edge2);
    float height = f3_dot(f3_sub(origin, corner), n);
    return b_or(height * f3_dot(span, n) >= 0.0f,
                height * height <= f3_dot(n, n) * texel_side * texel_side);
}

#endif
