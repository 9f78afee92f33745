// Points of surfaces in a small map of what a place sees over its plane (Maletz, Wang, Bowers 2011;
// algorithms.md A4). A point stands for a disk, and covers a square of as many texels as that has
// of solid angle, one at least; a texel keeps the nearest.
#ifndef BD_KERNEL_PROJECTED_POINT_H
#define BD_KERNEL_PROJECTED_POINT_H

#include "kernel/hemi_octahedral.h"
#include "kernel/stirred.h"

// --- a point's normal ---------------------------------------------------------------------------

// Ten bits a coordinate, from -511 to 511.
#define NORMAL_STEPS 511.0f
#define NORMAL_BITS  10u
#define NORMAL_MASK  1023u

KERNEL uint bits_of_normal(f3 normal)
{
    f3 steps = f3_add(f3_scale(normal, NORMAL_STEPS), f3_of(512.5f, 512.5f, 512.5f));
    return u_of(steps.x) | u_of(steps.y) << NORMAL_BITS | u_of(steps.z) << (2u * NORMAL_BITS);
}

// Unit but for a fivehundredth.
KERNEL f3 normal_of_bits(uint bits)
{
    f3 steps = f3_of(f_of(bits & NORMAL_MASK), f_of(bits >> NORMAL_BITS & NORMAL_MASK),
                     f_of(bits >> (2u * NORMAL_BITS) & NORMAL_MASK));
    return f3_scale(f3_sub(steps, f3_of(512.0f, 512.0f, 512.0f)), 1.0f / NORMAL_STEPS);
}

// --- what it covers -----------------------------------------------------------------------------

// Solid angle of a disk on its axis, 2 pi (1 - 1 / sqrt(1 + q)), as a part of pi q, what a small
// one has (A4, I3).
KERNEL float part_of_small_disk(float q)
{
    float s = f_sqrt(1.0f + q);
    return 2.0f / (s * (s + 1.0f));
}

// Whether it is over the place's plane, and seen from its front or back: what lies in the plane,
// but for rounding, or is seen from its edge, gives nothing.
#define FLAT_2 1e-6f
KERNEL bool is_point_seen(float height, float facing, float r2)
{
    return b_and(height > 0.0f, f_min(height * height, facing * facing) > FLAT_2 * r2);
}

// What a place may get of a disk, but for its radiance: its solid angle times the cosine to the
// place's normal. `facing`: its normal times the way to it, `height`: the place's.
KERNEL float importance_of_point(float height, float facing, float r2, float area)
{
    float per_r = 1.0f / f_sqrt(r2), far = area * facing * (per_r * per_r * per_r);
    return far * part_of_small_disk(far * (1.0f / F_PI)) * (height * per_r);
}

// Texels that it covers, of a map with so many along a side: a texel has 2 / (side^2 w^3), w how
// long a unit step along the ways' coordinates, all together, is; `per_sum` 1 over that of the way.
KERNEL float texels_of_point(float facing, float r2, float per_sum, float area, float side)
{
    float per_r = 1.0f / f_sqrt(r2), far = area * facing * (per_r * per_r * per_r);
    float texels = 0.5f * side * side * area * facing * (per_sum * per_sum * per_sum);
    return texels * part_of_small_disk(far * (1.0f / F_PI));
}

// As the paper has them (A4, Eq. 5): no disk is near, but for a solid angle that is a fifth too
// large where it is, and texels are alike.
KERNEL float importance_of_point_printed(float height, float facing, float r2, float area)
{
    float per_r2 = 1.0f / r2;
    return area * facing * height * (per_r2 * per_r2);
}

KERNEL float texels_of_point_printed(float facing, float r2, float area, float side)
{
    float cosine = facing / f_sqrt(r2);
    return side * side * area * cosine / (area + 2.0f * F_PI * r2);
}

// Of the area that points stand for, what they cover: of points that lie by chance, one that
// covered no more would leave holes beside it.
#define SPLAT_OVERLAP 2.0f

// One that is less than a texel covers a whole one, but not always: of a surface that is seen from
// its edge each point would, and all together many times what it has. Four times as often as it
// would be right leaves no holes in what is seen from its front, whose points are many in a texel.
#define KEPT_OFTEN 2.0f
KERNEL bool is_point_kept(uint drawn, float texels)
{
    return part_of_one(drawn) < KEPT_OFTEN * texels;
}

// What a point draws, by its name and the place's chance: whichever others are projected, and in
// whatever order.
KERNEL uint drawn_by_point(uint name, uint chance)
{
    uint drawn = (name ^ chance) * 0x85ebca6bu;
    drawn = (drawn ^ drawn >> 13u) * 0xc2b2ae35u;
    return drawn ^ drawn >> 16u;
}

// --- what a texel keeps -------------------------------------------------------------------------

// Of those that cover it the least: distance, to 1 in 2,048, before what the point drew, so that
// it is the same in whatever order they come, and whichever others do (A4, I4). The points of a
// wall are all as far off, along a texel's way. The bits of a float are nearly its logarithm: those
// of r^2 from 2^-58 to 2^6.
#define NO_POINT     0xffffffffu
#define SLOT_BITS    10u
#define SLOT_MASK    1023u
#define DRAWN_MASK   63u
#define NEAREST_R2   3.469446951953614e-18f
#define NEAREST_BITS 0x22800000u
#define FARTHEST_R2  63.9f

// Of a point's plane the square of how far off it is along a way, rather than of the point: or a
// slanted surface would be its near end. `facing` as above, `falls` the normal times the way, which
// is as long as `way2` says squared; no more than half or twice as far as the point.
KERNEL float distance2_of_plane(float facing, float r2, float falls, float way2)
{
    float along = facing * facing * way2 / f_max(falls * falls, 1e-37f);
    return f_min(f_max(along, 0.25f * r2), 4.0f * r2);
}

// Slots in no order of place: of those that drew alike, any may be kept. 0 is the only one that
// is 0.
KERNEL uint stirred_slot(uint slot)
{
    return slot * 2745u & SLOT_MASK;
}

KERNEL uint slot_of_stirred(uint slot)
{
    return slot * 905u & SLOT_MASK;
}

KERNEL uint key_of_point(float r2, uint drawn, uint slot)
{
    uint bits = f_bits(f_min(f_max(r2, NEAREST_R2), FARTHEST_R2)) - NEAREST_BITS;
    return bits >> 13u << 16u | (drawn & DRAWN_MASK) << SLOT_BITS | slot;
}

// Texels from the first to before the end, whole numbers, and the key that each may keep: NO_POINT
// of who covers none.
STRUCT(point_square)
{
    float first_u, first_v, end_u, end_v;
    uint key;
};

// `to` the way to the point and `normal` that of its disk, in the map's axes; `facing` their
// product; `drawn`: by the point.
KERNEL point_square square_of_point(f3 to, f3 normal, float facing, float area, float side,
                                    bool as_printed, uint slot, uint drawn)
{
    float r2 = f_max(f3_dot(to, to), NEAREST_R2), faces = f_abs(facing);
    float per_sum = 1.0f / f_max(f_abs(to.x) + f_abs(to.y) + f_abs(to.z), 1e-18f);
    float u = f_min(texel_of_place((to.x + to.y) * per_sum, side), side);
    float v = f_min(texel_of_place((to.x - to.y) * per_sum, side), side);
    float texels = f_select(as_printed, texels_of_point_printed(faces, r2, area, side),
                            SPLAT_OVERLAP * texels_of_point(faces, r2, per_sum, area, side));
    float half_side = 0.5f * f_max(f_sqrt(texels), 1.0f);
    point_square square;
    square.first_u = f_floor(f_min(f_max(u - half_side + 0.5f, 0.0f), side - 1.0f));
    square.first_v = f_floor(f_min(f_max(v - half_side + 0.5f, 0.0f), side - 1.0f));
    square.end_u = f_floor(f_min(u + half_side + 0.5f, side));
    square.end_v = f_floor(f_min(v + half_side + 0.5f, side));
    float places_of_texel = 2.0f / side;
    f3 middle = way_of_place((f_floor(u) + 0.5f) * places_of_texel - 1.0f,
                             (f_floor(v) + 0.5f) * places_of_texel - 1.0f);
    float plane2 = distance2_of_plane(facing, r2, f3_dot(normal, middle), f3_dot(middle, middle));
    bool is_kept = b_or(as_printed, is_point_kept(drawn, texels));
    bool covers = b_and(is_point_seen(to.z, facing, r2), is_kept);
    float far2 = f_select(as_printed, r2, plane2);
    square.key = u_select(covers, key_of_point(far2, drawn, slot), NO_POINT);
    return square;
}

#endif
