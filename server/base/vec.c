#include "base/vec.h"

bd_dvec3 bd_dvec3_normalize(bd_dvec3 a, bd_dvec3 fallback)
{
    // Scaled first: squares of 1e-200 or 1e200 would leave the range of double.
    double largest = fmax(fabs(a.x), fmax(fabs(a.y), fabs(a.z)));
    if (!(largest > 0) || !isfinite(largest)) return fallback;
    a = bd_dvec3_scale(a, 1.0 / largest);
    return bd_dvec3_scale(a, 1.0 / bd_dvec3_length(a));
}

bd_dmat4 bd_dmat4_identity(void)
{
    return (bd_dmat4){{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
}

bd_dmat4 bd_dmat4_mul(const bd_dmat4 *a, const bd_dmat4 *b)
{
    bd_dmat4 out;
    for (int c = 0; c < 4; c++) {
        for (int r = 0; r < 4; r++) {
            double sum = 0;
            for (int k = 0; k < 4; k++) sum += a->m[4 * k + r] * b->m[4 * c + k];
            out.m[4 * c + r] = sum;
        }
    }
    return out;
}

bd_dmat4 bd_dmat4_from_trs(const double translation[3], const double rotation[4],
                           const double scale[3])
{
    double x = rotation[0], y = rotation[1], z = rotation[2], w = rotation[3];
    double length = sqrt(x * x + y * y + z * z + w * w);
    if (length > 0 && isfinite(length)) {
        x /= length, y /= length, z /= length, w /= length;
    } else {
        x = y = z = 0, w = 1;
    }
    const double *s = scale;
    return (bd_dmat4){{
        (1 - 2 * (y * y + z * z)) * s[0], 2 * (x * y + z * w) * s[0], 2 * (x * z - y * w) * s[0], 0,
        2 * (x * y - z * w) * s[1], (1 - 2 * (x * x + z * z)) * s[1], 2 * (y * z + x * w) * s[1], 0,
        2 * (x * z + y * w) * s[2], 2 * (y * z - x * w) * s[2], (1 - 2 * (x * x + y * y)) * s[2], 0,
        translation[0], translation[1], translation[2], 1,
    }};
}

bd_dvec3 bd_dmat4_point(const bd_dmat4 *m, bd_dvec3 p)
{
    return bd_dvec3_add(bd_dmat4_direction(m, p), (bd_dvec3){m->m[12], m->m[13], m->m[14]});
}

bd_dvec3 bd_dmat4_direction(const bd_dmat4 *m, bd_dvec3 d)
{
    const double *e = m->m;
    return (bd_dvec3){e[0] * d.x + e[4] * d.y + e[8] * d.z, e[1] * d.x + e[5] * d.y + e[9] * d.z,
                      e[2] * d.x + e[6] * d.y + e[10] * d.z};
}

static void columns(const bd_dmat4 *m, bd_dvec3 *x, bd_dvec3 *y, bd_dvec3 *z)
{
    const double *e = m->m;
    *x = (bd_dvec3){e[0], e[1], e[2]};
    *y = (bd_dvec3){e[4], e[5], e[6]};
    *z = (bd_dvec3){e[8], e[9], e[10]};
}

double bd_dmat4_determinant3(const bd_dmat4 *m)
{
    bd_dvec3 x, y, z;
    columns(m, &x, &y, &z);
    return bd_dvec3_dot(x, bd_dvec3_cross(y, z));
}

bool bd_dmat4_inverse_affine(const bd_dmat4 *m, bd_dmat4 *out)
{
    bd_dvec3 x, y, z;
    columns(m, &x, &y, &z);
    bd_dvec3 yz = bd_dvec3_cross(y, z), zx = bd_dvec3_cross(z, x), xy = bd_dvec3_cross(x, y);
    double determinant = bd_dvec3_dot(x, yz);
    *out = bd_dmat4_identity();
    if (determinant == 0 || !isfinite(1.0 / determinant)) return false;
    const bd_dvec3 rows[3] = {bd_dvec3_scale(yz, 1.0 / determinant),
                              bd_dvec3_scale(zx, 1.0 / determinant),
                              bd_dvec3_scale(xy, 1.0 / determinant)};
    const bd_dvec3 offset = {m->m[12], m->m[13], m->m[14]};
    for (int r = 0; r < 3; r++) {
        out->m[0 + r] = rows[r].x;
        out->m[4 + r] = rows[r].y;
        out->m[8 + r] = rows[r].z;
        out->m[12 + r] = -bd_dvec3_dot(rows[r], offset);
    }
    return true;
}
