// Maps of the hemisphere about a normal: squares, in places from -1 to 1 (hemi-octahedral: Wang,
// Ng, Luebke, Humphreys 2006; Cigolle, Donow, Evangelakos, Mara, McGuire, Meyer 2014). Ways are in
// the map's own axes, whose z is the normal.
#ifndef BD_KERNEL_HEMI_OCTAHEDRAL_H
#define BD_KERNEL_HEMI_OCTAHEDRAL_H

#include "kernel/math.h"

// Of a map: its normal, and two vectors across that.
KERNEL f3 in_axes(f3 a, f3 u, f3 v, f3 normal)
{
    return f3_of(f3_dot(a, u), f3_dot(a, v), f3_dot(a, normal));
}

// The other way round.
KERNEL f3 from_axes(f3 a, f3 u, f3 v, f3 normal)
{
    return f3_add(f3_scale(u, a.x), f3_add(f3_scale(v, a.y), f3_scale(normal, a.z)));
}

// Place of a way that goes up, and how long it would be if it ended on the octahedron.
KERNEL f3 place_of_way(f3 way)
{
    float sum = f_abs(way.x) + f_abs(way.y) + f_abs(way.z);
    float per_sum = 1.0f / f_max(sum, 1e-37f);
    float x = way.x * per_sum, y = way.y * per_sum;
    return f3_of(x + y, x - y, f3_length(way) * per_sum);
}

// Which ends on the octahedron.
KERNEL f3 way_of_place(float place_u, float place_v)
{
    float x = 0.5f * (place_u + place_v), y = 0.5f * (place_u - place_v);
    return f3_of(x, y, 1.0f - f_abs(x) - f_abs(y));
}

// A place, in texels.
KERNEL float texel_of_place(float place, float side)
{
    return (0.5f * place + 0.5f) * side;
}
KERNEL float place_of_texel(float middle, float side)
{
    return 2.0f * middle / side - 1.0f;
}

// Of a chequerboard of squares of four texels, the half that one is in.
KERNEL uint half_of_texel(uint u, uint v)
{
    return (u / 2u + v / 2u) % 2u;
}

#endif
