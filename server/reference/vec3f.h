// Arithmetic of three floats, for the shading of the reference: directions, normals and colours.
//
// Plain arrays, as bsdf.h and surface.h have them. `out` may be an operand. Any thread.

#ifndef BD_REFERENCE_VEC3F_H
#define BD_REFERENCE_VEC3F_H

#include <math.h>
#include <stdbool.h>

#define BD_PI_F 3.14159265358979f

// Without the library's calls, which cost more than the comparison. The second if the first is NaN.
static inline float bd_minf(float a, float b)
{
    return a < b ? a : b;
}

static inline float bd_maxf(float a, float b)
{
    return a > b ? a : b;
}

static inline void bd_vec3f_set(float out[3], float x, float y, float z)
{
    out[0] = x, out[1] = y, out[2] = z;
}

static inline void bd_vec3f_copy(float out[3], const float a[3])
{
    bd_vec3f_set(out, a[0], a[1], a[2]);
}

static inline float bd_vec3f_dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void bd_vec3f_cross(float out[3], const float a[3], const float b[3])
{
    bd_vec3f_set(out, a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                 a[0] * b[1] - a[1] * b[0]);
}

static inline void bd_vec3f_scale(float out[3], const float a[3], float s)
{
    bd_vec3f_set(out, a[0] * s, a[1] * s, a[2] * s);
}

static inline void bd_vec3f_add_scaled(float out[3], const float a[3], const float b[3], float s)
{
    bd_vec3f_set(out, a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s);
}

// Product by component: one colour filtered by another.
static inline void bd_vec3f_filter(float out[3], const float a[3], const float b[3])
{
    bd_vec3f_set(out, a[0] * b[0], a[1] * b[1], a[2] * b[2]);
}

// False, and nothing changed, if the length is zero or not finite.
static inline bool bd_vec3f_normalize(float a[3])
{
    float length_squared = bd_vec3f_dot(a, a);
    if (!(length_squared > 0) || !isfinite(length_squared)) return false;
    bd_vec3f_scale(a, a, 1 / sqrtf(length_squared));
    return true;
}

static inline float bd_vec3f_mean(const float a[3])
{
    return (a[0] + a[1] + a[2]) * (1.0f / 3);
}

static inline float bd_vec3f_luminance(const float a[3])
{
    return 0.2126f * a[0] + 0.7152f * a[1] + 0.0722f * a[2];
}

// A right-handed frame around the unit vector `n` (Duff et al. 2017, Building an Orthonormal
// Basis, Revisited).
static inline void bd_vec3f_frame(const float n[3], float x[3], float y[3])
{
    float sign = copysignf(1, n[2]), a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
    bd_vec3f_set(x, 1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]);
    bd_vec3f_set(y, b, sign + n[1] * n[1] * a, -n[1]);
}

#endif
