// Kernels from a VPL to a receiver, as irradiance for a unit of outgoing flux P.

#include "common/pi.glsl"

// Wallace's disk to point (algorithms.md A2.2): E = P cos cos / (pi r^2 + A). The dots are with
// the vector from receiver to VPL, not normalised: `to_vpl` of length r gives cos = dot / r.
// Bare kernel: area = 0.
float disk_kernel(float receiver_dot, float vpl_dot, float r2, float area)
{
    return receiver_dot * vpl_dot / (r2 * (PI * r2 + area));
}

// Angle between unit vectors, well conditioned at 0 and at pi, where acos is not.
float angle_between(vec3 a, vec3 b)
{
    return 2.0 * atan(length(a - b), length(a + b));
}

// Term of Lambert's formula for the edge a -> b above the horizon of n (algorithms.md D6).
float edge_term(vec3 a, vec3 b, vec3 n)
{
    vec3 across = cross(a, b);
    float sine = length(across);
    if (!(sine > 0.0)) return 0.0;
    return angle_between(normalize(a), normalize(b)) * dot(n, across) / sine;
}

// Form factor from a point with unit normal n to the parallelogram centre +- u +- v, all relative
// to the point, clipped to the point's horizon: (1 / 2 pi) sum of gamma_k n . (v_k x v_k+1).
// Exact at every distance; the sign of the winding is dropped.
float quad_form_factor(vec3 centre, vec3 u, vec3 v, vec3 n)
{
    vec3 corners[4] = vec3[4](centre - u - v, centre + u - v, centre + u + v, centre - u + v);
    float sum = 0.0;
    // A convex polygon crosses the horizon at most once down and once up; the piece of horizon
    // between the two closes the clipped polygon.
    vec3 down = vec3(0.0), up = vec3(0.0);
    bool crosses = false;
    for (int k = 0; k < 4; k++) {
        vec3 a = corners[k], b = corners[(k + 1) & 3];
        float height_a = dot(a, n), height_b = dot(b, n);
        if (height_a <= 0.0 && height_b <= 0.0) continue;
        // A corner on the horizon ends the part above as a crossing does.
        if (height_b <= 0.0) {
            b = mix(a, b, height_a / (height_a - height_b));
            down = b;
            crosses = true;
        } else if (height_a <= 0.0) {
            a = mix(a, b, height_a / (height_a - height_b));
            up = a;
            crosses = true;
        }
        sum += edge_term(a, b, n);
    }
    // That piece lies in the horizon itself: its cross product is along n, whatever its rounding.
    if (crosses) {
        float gamma = angle_between(normalize(down), normalize(up));
        sum += dot(n, cross(down, up)) < 0.0 ? -gamma : gamma;
    }
    return abs(sum) * (0.5 / PI);
}
