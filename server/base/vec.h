// Double-precision vectors and column-major 4x4 matrices, for everything that is computed once a
// revision: node hierarchies, light frames, camera frames.
//
// Why not cglm here: it has no double precision, and a scene a million sizes away from its origin
// keeps its shape only while positions stay in double until the scene's own origin is subtracted.
// Column-major as in glTF: element (row r, column c) is m[4 * c + r]. Names read right to left:
// world_from_node * node_from_mesh = world_from_mesh.

#ifndef BD_BASE_VEC_H
#define BD_BASE_VEC_H

#include <math.h>
#include <stdbool.h>

typedef struct {
    double x, y, z;
} bd_dvec3;

typedef struct {
    double m[16];
} bd_dmat4;

static inline bd_dvec3 bd_dvec3_add(bd_dvec3 a, bd_dvec3 b)
{
    bd_dvec3 r = {a.x + b.x, a.y + b.y, a.z + b.z};
    return r;
}

static inline bd_dvec3 bd_dvec3_sub(bd_dvec3 a, bd_dvec3 b)
{
    bd_dvec3 r = {a.x - b.x, a.y - b.y, a.z - b.z};
    return r;
}

static inline bd_dvec3 bd_dvec3_scale(bd_dvec3 a, double s)
{
    bd_dvec3 r = {a.x * s, a.y * s, a.z * s};
    return r;
}

static inline double bd_dvec3_dot(bd_dvec3 a, bd_dvec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline bd_dvec3 bd_dvec3_cross(bd_dvec3 a, bd_dvec3 b)
{
    bd_dvec3 r = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    return r;
}

static inline double bd_dvec3_length(bd_dvec3 a)
{
    return sqrt(bd_dvec3_dot(a, a));
}

// `fallback` if the length is zero or not finite.
bd_dvec3 bd_dvec3_normalize(bd_dvec3 a, bd_dvec3 fallback);

bd_dmat4 bd_dmat4_identity(void);
bd_dmat4 bd_dmat4_mul(const bd_dmat4 *a, const bd_dmat4 *b);
// Rotation is a quaternion x, y, z, w and is normalised here; a zero quaternion is no rotation.
bd_dmat4 bd_dmat4_from_trs(const double translation[3], const double rotation[4],
                           const double scale[3]);
bd_dvec3 bd_dmat4_point(const bd_dmat4 *m, bd_dvec3 p);
bd_dvec3 bd_dmat4_direction(const bd_dmat4 *m, bd_dvec3 d);
// Determinant of the upper left 3x3: negative if the matrix mirrors.
double bd_dmat4_determinant3(const bd_dmat4 *m);
// Inverse of an affine matrix. False, and identity, if it is singular.
bool bd_dmat4_inverse_affine(const bd_dmat4 *m, bd_dmat4 *out);

#endif
