// Receivers of a set (pass/receiver_sets.h) that lie on one surface, as far as that goes: they look
// at the same points. A cut for all of a set that has an edge in it is none that fits, and what is
// near is drawn too rarely.
//
// Private to pass/. Thread: any.

#ifndef BD_PASS_POINT_SURFACES_H
#define BD_PASS_POINT_SURFACES_H

#include "lights/point_clusters.h"
#include "pass/receiver_sets.h"

#define BD_POINT_SURFACES_MAX 8u

struct bd_point_surfaces {
    uint32_t count;
    struct bd_points_about about[BD_POINT_SURFACES_MAX];
    f3 position[BD_POINT_SURFACES_MAX], normal[BD_POINT_SURFACES_MAX]; // of the first of each
    uint32_t of_place[BD_SET_MOST]; // of each of the set's receivers
};

void bd_point_surfaces_of(const struct bd_receiver_part *part, const struct bd_receiver_set *set,
                          struct bd_point_surfaces *out);

#endif
