// Imperfect shadow maps (Ritschel, Grosch, Kim, Seidel, Dachsbacher, Kautz 2008; algorithms.md
// A0.6): what a virtual light sees of the scene, as disks about points of its surfaces. A texel
// has the disk that is nearest along the ray through its middle, and a receiver is hidden where it
// lies beyond the plane of that disk, which lies above its own: a wall hides nothing of itself,
// however coarse the map, nor does what is round.
//
// A map is over the hemisphere about the light's normal (kernel/hemi_octahedral.h).
#ifndef BD_KERNEL_IMPERFECT_SHADOW_H
#define BD_KERNEL_IMPERFECT_SHADOW_H

#include "kernel/hemi_octahedral.h"

// How far a disk reaches from its middle, in places, at most. `to` its middle, `on_octahedron` as
// place_of_way says: a small turn is at most sqrt(6) times its square in places, larger ones of up
// to .3 a little more.
KERNEL float reach_of_disk(f3 to, float radius2, float on_octahedron)
{
    float r2 = f3_dot(to, to);
    float turn = f_sqrt(radius2 / f_max(r2 - radius2, 0.04f * radius2 + 1e-37f));
    return 2.4495f * on_octahedron * on_octahedron * turn * (1.0f + 0.8f * turn);
}

// How far away a disk is along a way that ends on the octahedron; 0 where that misses it.
KERNEL float distance_to_disk(f3 to, f3 normal, float radius2, f3 way)
{
    float falls = f3_dot(normal, way), height = f3_dot(normal, to);
    float part = height / f_select(f_abs(falls) > 1e-12f, falls, 1e-12f);
    f3 miss = f3_sub(f3_scale(way, part), to);
    bool is_met = b_and(part > 0.0f, f3_dot(miss, miss) < radius2);
    return f_select(is_met, part, 0.0f) * f3_length(way);
}

// What a texel keeps of the disks that it meets, the least: the distance to 1 in 256 before the
// disk's number, so that it is the same in whatever order they come.
#define NO_DISK    0xffffffffu
#define DISK_BITS  16u
#define DISKS_MOST 0xffffu
KERNEL uint key_of_disk(float distance, uint disk)
{
    uint key = ((f_bits(distance) >> 15u) << DISK_BITS) | disk;
    return u_select(distance > 0.0f, key, NO_DISK);
}

// How high above a receiver's plane, as a part of how far off, a disk lies that hides anything:
// the middle of one that reaches over an edge of the receiver's own surface does not. Of those
// farther off than two of its radii, as a part of that.
#define ABOVE_LEAST 0.15f

// Whether the disk hides a receiver from the map's middle, whence `to` goes to the receiver and
// `disk` to the disk's own middle. What lies beyond its plane by less than `bias` of how far from
// the disk's middle one looks through it is still on its surface, which may be hollow.
KERNEL bool hides(f3 disk, f3 normal, float radius2, f3 to, f3 receiver_normal, float bias)
{
    f3 away = f3_sub(disk, to);
    float before = -f3_dot(normal, disk), beyond = -f3_dot(normal, away);
    float across = before - beyond;
    float part = before / f_select(across == 0.0f, 1.0f, across);
    float miss = f3_length(f3_sub(f3_scale(to, part), disk));
    float least = ABOVE_LEAST * f_sqrt(f_min(f3_dot(away, away), 4.0f * radius2));
    bool is_beyond = f_abs(beyond) > bias * miss + 1e-4f * f3_length(to);
    bool is_above_it = f3_dot(receiver_normal, away) > least;
    return b_and(b_and(before * beyond < 0.0f, is_beyond), is_above_it);
}

#endif
