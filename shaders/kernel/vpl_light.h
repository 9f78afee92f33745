// What a VPL sends to a receiver. n and n_geometric are the receiver's unit normals; to_vpl goes
// from the receiver to the VPL, r2 is its squared length.
#ifndef BD_KERNEL_VPL_LIGHT_H
#define BD_KERNEL_VPL_LIGHT_H

#include "kernel/all_channels.h"
#include "kernel/form_factor.h"

// Squared distances below this are a receiver on the VPL itself (render space is about 1 wide).
#define COINCIDENT_SQUARED 1e-12f
// A receiver in the VPL's own plane gets nothing from it, and the patch's form factor has no value
// there; nor does a VPL in the receiver's plane give it anything, however its shading normal leans.
// So that rounding cannot lift one out of the other's plane (hazard 3): the sine must be above what
// a normal loses in the G-buffer (3e-5), the height above what a position does.
#define COPLANAR_SQUARED 4e-8f
#define COPLANAR_HEIGHT  1e-5f

KERNEL bool is_above(float height, float r2)
{
    return b_and(height > COPLANAR_HEIGHT, height * height > COPLANAR_SQUARED * r2);
}

KERNEL bool faces(f3 vpl_normal, f3 to_vpl, float r2)
{
    return is_above(-f3_dot(vpl_normal, to_vpl), r2);
}

// Neither is below the other's horizon.
KERNEL bool see_each_other(f3 n, f3 n_geometric, f3 to_vpl, float r2, f3 vpl_normal)
{
    bool above = b_and(f3_dot(n, to_vpl) > 0.0f, is_above(f3_dot(n_geometric, to_vpl), r2));
    return b_and(above, b_and(r2 > COINCIDENT_SQUARED, faces(vpl_normal, to_vpl, r2)));
}

// What a VPL's kernel is no more than, which the array keeps as a distance below 0 (shared/vpl.h):
// where it is clamped no patch is integrated.
#define VPL_UNBOUNDED 3e38f

KERNEL float bound_of_near(float near2)
{
    return f_select(near2 < 0.0f, -near2, VPL_UNBOUNDED);
}

// Irradiance of a unit of flux from a disk.
KERNEL float disk_light(f3 n, f3 n_geometric, f3 to_vpl, float r2, f3 vpl_normal, float area,
                        float bound)
{
    float kernel = disk_kernel(f3_dot(n, to_vpl), -f3_dot(vpl_normal, to_vpl), r2, area);
    float light = f_min(kernel, bound);
    return f_select(see_each_other(n, n_geometric, to_vpl, r2, vpl_normal), light, 0.0f);
}

// Of the parallelogram +- u +- v around the VPL. A patch reaches over the edge of what it stands
// for: only one whose centre is above the receiver's surface counts, or the outside of a thin wall
// is lit from within. Nothing behind the patch's own plane: the VPL's normal, which is smoothed or
// bent, would have a point that lies just beneath it in front, and covered by it altogether.
KERNEL float patch_light(f3 n, f3 n_geometric, f3 to_vpl, float r2, f3 u, f3 v, float inverse_area)
{
    bool seen = b_and(is_above(f3_dot(n_geometric, to_vpl), r2),
                      is_above(-f3_dot(f3_unit(f3_cross(u, v)), to_vpl), r2));
    return f_select(seen, quad_form_factor(to_vpl, u, v, n) * inverse_area, 0.0f);
}

// Light that grazes the receiver would make the vector long along the surface, for normals so far
// from its own that they are no longer the same surface.
#define VECTOR_COSINE_MIN 0.2f
#define VECTOR_LENGTH_MIN 1e-12f // for 0 / 0 where a VPL is at the receiver and gives nothing

// Per unit of the VPL's irradiance, but for what it has along the normal (irradiance_vector).
KERNEL f3 direction_of_unit(f3 to_vpl, float r2, f3 n)
{
    float height = f_max(f3_dot(to_vpl, n), VECTOR_COSINE_MIN * f_sqrt(r2));
    return f3_scale(to_vpl, 1.0f / f_max(height, VECTOR_LENGTH_MIN));
}

// The irradiance vector, of all channels together: its dot product with the receiver's normal is
// their irradiance, and near it for normals near that one. What all VPLs have along the normal is
// known from their irradiance: so it is left out of the sum's terms, and of the sum.
KERNEL f3 irradiance_vector(f3 irradiance, f3 directions, f3 n)
{
    return f3_add(directions, f3_scale(n, all_channels(irradiance) - f3_dot(directions, n)));
}

#endif
