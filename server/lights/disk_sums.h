// Sums over the points on a disk, of a colour that each has, by a parabola that is 1 in the disk's
// middle and 0 at its edge (Epanechnikov 1969). What lies off the disk's plane counts as eight
// times as far.
//
// Many points cost little: of a part of their tree that lies on the disk whole, its moments tell
// what its points would, but for rounding. Those along the edge are looked at one by one.
//
// A function of the points and their order. Cost: 120 ns a point to build; a disk of 30 points 2
// us, of 3,000 points 17, of 100,000 points 130.
//
// Private to lights/, but for the cuts. Thread: built by one, then read by all.

#ifndef BD_LIGHTS_DISK_SUMS_H
#define BD_LIGHTS_DISK_SUMS_H

#include "lights/facing_trees.h"

#define BD_DISK_FACES_ALIKE 0.7f // cosine: who faces otherwise is not on it
#define BD_DISK_OFF_PLANE   8.0f

struct bd_disk {
    f3 position, normal; // unit
    float within2;       // its radius, squared
};

// Whether the point is on it, and how far from its middle.
static inline bool bd_disk_holds(const struct bd_disk *disk, const struct bd_point_node *node,
                                 float *distance2)
{
    const f3 away = f3_sub(node->position, disk->position);
    const float off = f3_dot(away, disk->normal);
    *distance2 = f3_dot(away, away) + (BD_DISK_OFF_PLANE * BD_DISK_OFF_PLANE - 1) * off * off;
    return *distance2 < disk->within2 && f3_dot(node->normal, disk->normal) >= BD_DISK_FACES_ALIKE;
}

// What stands on the disk, seen from its middle in directions round it, the first along the x of
// bd_basis_of its normal: what lies behind such a plane, between it and its neighbours, does not
// count, or light would come through walls.
#define BD_DISK_CUTS 12u
struct bd_disk_cut {
    f3 point, normal; // of what is met, to the middle's side; 0: nothing is
};

// Of the points of each facing.
struct bd_disk_part;
struct bd_disk_sums {
    const struct bd_facing_trees *trees;
    const f3 *colours; // of the points; NULL: 1 each
    struct bd_disk_part *parts[BD_FACINGS];
};

// Both stay the caller's, and must outlive it. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_disk_sums_init(struct bd_disk_sums *sums, const struct bd_facing_trees *trees,
                              const f3 *colours, struct bd_err_detail *detail);
void bd_disk_sums_finish(struct bd_disk_sums *sums);
uint64_t bd_disk_sums_bytes(const struct bd_disk_sums *sums);

// `cuts`: BD_DISK_CUTS, or NULL: nothing stands there.
f3 bd_disk_sums_of(const struct bd_disk_sums *sums, const struct bd_disk *disk,
                   const struct bd_disk_cut *cuts);
// Calls `look` for each of the points, for what no sum tells: those of near parts first. `look` may
// make the disk smaller.
void bd_disk_sums_each(const struct bd_disk_sums *sums, const struct bd_disk *disk,
                       const struct bd_disk_cut *cuts,
                       void (*look)(void *user, uint32_t number, float distance2), void *user);

#endif
