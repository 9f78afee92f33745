// What nodes of a tree of VPLs (shared/vpl_tree.h) are made of: leaves of VPLs, inner nodes of the
// four below them.
#ifndef BD_KERNEL_VPL_TREE_BUILD_H
#define BD_KERNEL_VPL_TREE_BUILD_H

#include "kernel/vpl_tree.h"

#define TREE_FAR 3.4e38f // corners of no box; radiosity of the bare kernel

KERNEL f3 least_corner(f3 a, f3 b)
{
    return f3_of(f_min(a.x, b.x), f_min(a.y, b.y), f_min(a.z, b.z));
}

KERNEL f3 greatest_corner(f3 a, f3 b)
{
    return f3_of(f_max(a.x, b.x), f_max(a.y, b.y), f_max(a.z, b.z));
}

// --- leaves -------------------------------------------------------------------------------------

// How far the patch's own normal is from the VPL's, which may be bent by a normal map.
KERNEL float patch_chord(f3 normal, f3 u, f3 v)
{
    f3 across = f3_cross(u, v);
    float size = f3_length(across);
    f3 own = f3_scale(across, 1.0f / f_max(size, 1e-37f));
    float chord = f_min(f3_length(f3_sub(own, normal)), f3_length(f3_add(own, normal)));
    return f_select(size > 0.0f, chord, 0.0f);
}

// Of the box around the patch, from its centre.
KERNEL f3 patch_reach(f3 u, f3 v)
{
    return f3_add(f3_abs(u), f3_abs(v));
}

KERNEL float radiosity_of_vpl(f3 flux, float area)
{
    bool is_bounded = area > 0.0f;
    float radiosity = strongest(flux) / f_select(is_bounded, area, 1.0f);
    return f_select(is_bounded, radiosity, TREE_FAR);
}

KERNEL float distance2_of_light(f3 position, f3 light, bool directional)
{
    f3 from_light = f3_sub(position, light);
    return f_select(directional, 1.0f, f3_dot(from_light, from_light));
}

// --- inner nodes --------------------------------------------------------------------------------

// Of a node's flux, what one of its children sends.
KERNEL float share_of_child(f3 child_flux, f3 flux)
{
    float whole = all_channels(flux);
    return all_channels(child_flux) / f_select(whole > 0.0f, whole, 1.0f);
}

// What a child asks of the chord of the node with that mean normal.
KERNEL float chord_with_child(f3 child_flux, f3 child_normal, float child_chord, f3 normal)
{
    float chord = child_chord + f3_length(f3_sub(child_normal, normal));
    return f_select(all_channels(child_flux) > 0.0f, chord, 0.0f);
}

// --- its first lobe -----------------------------------------------------------------------------
//
// Of the children's eight lobes those that face rather as the largest than as the one that differs
// most from it. Of equals the first.

// A number in steps of 1 / 2048 of itself: rounding, which changes with the light's power, must not
// choose between lobes that are equal.
KERNEL float in_steps(float number)
{
    return f_of_bits((f_bits(number) + 0x800u) & 0xfffff000u);
}

// None where the normal has none.
KERNEL f3 direction_of_lobe(f3 normal)
{
    return f3_scale(normal, 1.0f / f_max(f3_length(normal), 1e-37f));
}

// How much of a lobe does not face along a unit vector.
KERNEL float off_direction(f3 normal, f3 direction)
{
    return in_steps(f3_length(normal) - f3_dot(normal, direction));
}

#define LOBE_NO_TIE 1e-3f

// 1, or 0 where a lobe faces rather as the other one, by the directions of that and the largest.
KERNEL float part_of_first(f3 normal, f3 largest, f3 other)
{
    bool is_other = f3_dot(normal, f3_sub(other, largest)) > LOBE_NO_TIE * f3_length(normal);
    return f_select(is_other, 0.0f, 1.0f);
}

#endif
