// From a VPL to a receiver, as irradiance for a unit of outgoing flux P.
#ifndef BD_KERNEL_FORM_FACTOR_H
#define BD_KERNEL_FORM_FACTOR_H

#include "kernel/math.h"

// Wallace's disk to point (algorithms.md A2.2): E = P cos cos / (pi r^2 + A). The dots are with
// the vector from receiver to VPL, not normalised: `to_vpl` of length r gives cos = dot / r.
// Bare kernel: area = 0.
KERNEL float disk_kernel(float receiver_dot, float vpl_dot, float r2, float area)
{
    return receiver_dot * vpl_dot / (r2 * (F_PI * r2 + area));
}

// Angle between vectors, well conditioned at 0 and at pi, where acos is not, times the cosine of
// their plane's normal to n: Lambert's term for the edge a -> b above the horizon of n
// (algorithms.md D6).
KERNEL float edge_term(f3 a, f3 b, f3 n)
{
    f3 across = f3_cross(a, b);
    float sine = f3_length(across);
    float term = f_angle(sine, f3_dot(a, b)) * f3_dot(n, across) / f_max(sine, 1e-37f);
    return f_select(sine > 0.0f, term, 0.0f);
}

// Of a polygon whose edges are gone round: what they add up to, where they cross the horizon, and
// how often.
STRUCT(clipped_sum)
{
    float sum;
    f3 down, up;
    float crossings;
};

// A corner on the horizon ends the part above as a crossing does. Of an edge below, both ends are
// where it would cross, and it adds nothing.
KERNEL clipped_sum add_edge(clipped_sum s, f3 a, f3 b, f3 n)
{
    float height_a = f3_dot(a, n), height_b = f3_dot(b, n);
    float above_a = f_select(height_a > 0.0f, 1.0f, 0.0f);
    float above_b = f_select(height_b > 0.0f, 1.0f, 0.0f);
    float fall = above_a - above_b; // 1, or -1 where the edge rises
    f3 crossing = f3_between(a, b, height_a / f_select(fall == 0.0f, 1.0f, height_a - height_b));
    f3 from = f3_select(above_a > 0.0f, a, crossing), to = f3_select(above_b > 0.0f, b, crossing);
    s.sum = s.sum + edge_term(from, to, n);
    s.down = f3_select(fall > 0.0f, crossing, s.down);
    s.up = f3_select(fall < 0.0f, crossing, s.up);
    s.crossings = s.crossings + f_abs(fall);
    return s;
}

// Form factor from a point with unit normal n to the parallelogram centre +- u +- v, all relative
// to the point, clipped to the point's horizon: (1 / 2 pi) sum of gamma_k n . (v_k x v_k+1).
// Exact at every distance; the sign of the winding is dropped.
KERNEL float quad_form_factor(f3 centre, f3 u, f3 v, f3 n)
{
    f3 left = f3_sub(centre, u), right = f3_add(centre, u);
    f3 a = f3_sub(left, v), b = f3_sub(right, v), c = f3_add(right, v), d = f3_add(left, v);
    // A convex polygon crosses the horizon at most once down and once up; the piece of horizon
    // between the two closes the clipped polygon.
    f3 none = f3_of(0.0f, 0.0f, 0.0f);
    clipped_sum s;
    s.sum = 0.0f;
    s.down = none;
    s.up = none;
    s.crossings = 0.0f;
    s = add_edge(s, a, b, n);
    s = add_edge(s, b, c, n);
    s = add_edge(s, c, d, n);
    s = add_edge(s, d, a, n);
    // That piece lies in the horizon itself: its cross product is along n, whatever its rounding.
    f3 across = f3_cross(s.down, s.up);
    float gamma = f_angle(f3_length(across), f3_dot(s.down, s.up));
    float closing = f_select(f3_dot(n, across) < 0.0f, -gamma, gamma);
    return f_abs(s.sum + f_select(s.crossings > 0.0f, closing, 0.0f)) * (0.5f / F_PI);
}

#endif
