// Directions for two numbers in [0, 1), in a frame about +z, and that frame about a normal.
//
// Thread: any.

#ifndef BD_LIGHTS_DIRECTIONS_H
#define BD_LIGHTS_DIRECTIONS_H

#include <math.h>

#include "kernel/math.h"

struct bd_basis {
    f3 x, y;
};

// Of a unit normal (Duff et al. 2017).
static inline struct bd_basis bd_basis_of(f3 n)
{
    const float sign = copysignf(1, n.z), a = -1 / (sign + n.z), b = n.x * n.y * a;
    return (struct bd_basis){f3_of(1 + sign * n.x * n.x * a, sign * b, -sign * n.x),
                             f3_of(b, sign + n.y * n.y * a, -n.y)};
}

static inline f3 bd_from_basis(const struct bd_basis *basis, f3 n, f3 d)
{
    return f3_add(f3_scale(basis->x, d.x), f3_add(f3_scale(basis->y, d.y), f3_scale(n, d.z)));
}

// As often as their cosine is large.
static inline f3 bd_cosine_direction(const float number[2])
{
    const float radius = f_sqrt(number[0]), turn = 2 * F_PI * number[1];
    return f3_of(radius * cosf(turn), radius * sinf(turn), f_sqrt(1 - number[0]));
}

// At an angle of that cosine from +z, so far round it.
static inline f3 bd_direction_at(float cosine, float number)
{
    const float radius = f_sqrt(f_max(1 - cosine * cosine, 0)), turn = 2 * F_PI * number;
    return f3_of(radius * cosf(turn), radius * sinf(turn), cosine);
}

// A microfacet's normal, as often as the viewer sees such: about a shading normal, of GGX facets as
// wide as `alpha` (Heitz 2018).
static inline f3 bd_visible_normal(f3 n, f3 viewer, float alpha, const float number[2])
{
    const struct bd_basis basis = bd_basis_of(n);
    const f3 stretched =
        f3_unit(f3_of(alpha * f3_dot(viewer, basis.x), alpha * f3_dot(viewer, basis.y),
                      f_max(f3_dot(viewer, n), 1e-4f)));
    const float across2 = stretched.x * stretched.x + stretched.y * stretched.y;
    const f3 t1 = across2 > 0 ? f3_scale(f3_of(-stretched.y, stretched.x, 0), 1 / f_sqrt(across2))
                              : f3_of(1, 0, 0);
    const f3 t2 = f3_cross(stretched, t1);
    const float radius = f_sqrt(number[0]), turn = 2 * F_PI * number[1];
    const float p1 = radius * cosf(turn), share = 0.5f * (1 + stretched.z);
    const float p2 = (1 - share) * f_sqrt(f_max(1 - p1 * p1, 0)) + share * radius * sinf(turn);
    const float p3 = f_sqrt(f_max(1 - p1 * p1 - p2 * p2, 0));
    const f3 m = f3_add(f3_scale(t1, p1), f3_add(f3_scale(t2, p2), f3_scale(stretched, p3)));
    return bd_from_basis(&basis, n, f3_unit(f3_of(alpha * m.x, alpha * m.y, f_max(m.z, 1e-7f))));
}

#endif
