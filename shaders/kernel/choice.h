// What a receiver chooses VPLs by, and where its rays to them go.
#ifndef BD_KERNEL_CHOICE_H
#define BD_KERNEL_CHOICE_H

#include "kernel/vpl_light.h"

// A near VPL is integrated as a patch where it is chosen, and has light even where its centre is
// below a horizon: there cosines count as these at least, so that whatever gives light can be
// chosen.
#define NEAR_COSINE_MIN 0.1f

// How much a unit of a VPL's flux would give a receiver if nothing stood between them: by the disk,
// exact where VPLs are far. near2 = 0: none is integrated as a patch; below: bound_of_near.
KERNEL float strength_of_unit(f3 n, f3 n_geometric, f3 to_vpl, float r2, f3 vpl_normal, float area,
                              float near2)
{
    bool near = b_and(r2 < near2, b_and(faces(vpl_normal, to_vpl, r2),
                                        is_above(f3_dot(n_geometric, to_vpl), r2)));
    bool seen = see_each_other(n, n_geometric, to_vpl, r2, vpl_normal);
    float least = NEAR_COSINE_MIN * f_sqrt(r2);
    float receiver_dot = f3_dot(n, to_vpl), vpl_dot = -f3_dot(vpl_normal, to_vpl);
    float of_near = f_max(receiver_dot, least) * f_max(vpl_dot, least);
    float of_far = f_select(seen, receiver_dot * vpl_dot, 0.0f);
    float light = f_select(near, of_near, of_far) / f_max(r2 * (F_PI * r2 + area), 1e-37f);
    return f_min(light, bound_of_near(near2));
}

// What a height counts as that parts of a group exceed by up to `reach`: more than 0 where theirs is,
// and at least half of it, so that no part is chosen far too rarely.
KERNEL float height_within(float height, float reach)
{
    return f_max(f_max(height, 0.5f * (height + reach)), 0.0f);
}

// The same of a whole group of VPLs (shared/vpl.h), for receivers that are far from it: about what
// its VPLs would give, and more than 0 where one of them gives anything.
KERNEL float strength_of_group(f3 n, f3 n_geometric, f3 to_group, float r2, f3 mean_normal,
                               float normal_spread, float radius, float area)
{
    float reach = radius + normal_spread * (f_sqrt(r2) + radius);
    float receiver_dot = height_within(f3_dot(n, to_group), radius);
    float group_dot = height_within(-f3_dot(mean_normal, to_group), reach);
    float light = receiver_dot * group_dot / f_max(r2 * (F_PI * r2 + area), 1e-37f);
    return f_select(f3_dot(n_geometric, to_group) > -radius, light, 0.0f);
}

// On the surface that a VPL stands for: at its representative texel, since a mean of texels may lie
// within a curved wall; a point is there. along = shared/vpl.h's places, in u and v.
KERNEL f3 end_of_segment(f3 position, f3 u, f3 v, float inverse_area, float along_u, float along_v)
{
    f3 texel = f3_sub(f3_sub(position, f3_scale(u, along_u)), f3_scale(v, along_v));
    return f3_select(inverse_area < 0.0f, position, texel);
}

#endif
