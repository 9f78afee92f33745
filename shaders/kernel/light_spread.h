// How far off light may be that was gathered at one point of a block and is interpolated over it:
// an estimate, not a bound, and cheap enough to be summed with the light.
//
// Over a block of radius s at the distance r light of a VPL changes by parts of s / r. What is
// linear in that is interpolated rightly; the rest is its square, and what a horizon within the
// block cuts off: the VPL's, which a plane crosses unless both are parallel (so a lit wall has no
// say about itself), and the receiver's, where the block is no plane.
#ifndef BD_KERNEL_LIGHT_SPREAD_H
#define BD_KERNEL_LIGHT_SPREAD_H

#include "kernel/math.h"

#define SPREAD_OF_SQUARE      2.0f
#define SPREAD_OF_VPL_HORIZON 0.5f
#define SPREAD_OF_OWN_HORIZON 0.5f
// What is below this part of the light that VPLs would send without cosines does not count: it is
// next to nothing, and nothing in dark corners would ever be enough.
#define SPREAD_IGNORED 0.002f

// Of a VPL with that flux, all channels together. `radius` of the block, render units; `off_plane`:
// how far its surface leaves the plane of its normal, as a part of that.
KERNEL float spread_of_vpl(float radius, float off_plane, f3 n, f3 to_vpl, float r2, f3 vpl_normal,
                           float area, float flux)
{
    float near2 = radius * radius / (r2 + radius * radius);
    float near = f_sqrt(near2), inverse = 1.0f / f_sqrt(r2 + 1e-30f);
    float here = f3_dot(n, to_vpl) * inverse, there = -f3_dot(vpl_normal, to_vpl) * inverse;
    float aslant = f3_dot(vpl_normal, n);
    float turn = near * f_max(f_sqrt(f_max(1.0f - aslant * aslant, 0.0f)), off_plane);
    float square = SPREAD_OF_SQUARE * near2 * f_max(here, 0.0f) * f_max(there + turn, 0.0f);
    float vpl_horizon = SPREAD_OF_VPL_HORIZON * turn * f_max(here, 0.0f);
    float own_horizon = SPREAD_OF_OWN_HORIZON * near * off_plane * f_max(there + near, 0.0f);
    float part = square + f_select(f_abs(there) < turn, vpl_horizon, 0.0f) +
                 f_select(f_abs(here) < near * off_plane, own_horizon, 0.0f);
    return flux * (part - SPREAD_IGNORED) / (F_PI * r2 + area);
}

// Cosine under which a texel of a map shows a surface, at least: flatter it would show more of it
// than a block is large.
#define FACING_LEAST 0.05f

// Of what a texel of a map of the hemisphere shows (kernel/hemi_octahedral.h), which is taken for a
// patch that fills it: `way` through its middle, the patch's normal and `r2`, how far off it is, in
// the map's axes; `light` what it sends, all channels together.
KERNEL float spread_of_texel(float radius, float off_plane, f3 way, float solid_angle, float r2,
                             f3 normal, float light)
{
    float area = solid_angle * r2 / f_max(-f3_dot(normal, way), FACING_LEAST);
    return spread_of_vpl(radius, off_plane, f3_of(0.0f, 0.0f, 1.0f), f3_scale(way, f_sqrt(r2)), r2,
                         normal, area, F_PI * light * area);
}

#endif
