// Which of the points that are spread over all surfaces (lights/surface_points.h) stand for a place
// on one of them: those nearest to it that face alike. What lies off the place's plane counts as
// four times as far, or a table's light would fall on what stands below it.
//
// A k-d tree (Bentley 1975), balanced. A function of the points, of which it keeps what it needs.
// Cost: some 150 ns a point to build, 1 to 2 us a place.
//
// Thread: built by one, then read by all.

#ifndef BD_LIGHTS_POINT_TREE_H
#define BD_LIGHTS_POINT_TREE_H

#include "lights/point_halves.h"
#include "lights/surface_points.h"

_Static_assert(BD_SURFACE_POINTS_MAX < 1 << 30, "points have numbers");

struct bd_point_tree {
    uint32_t count;              // of points
    float area;                  // that each stands for
    struct bd_point_node *nodes; // of each part the one in the middle divides the others
};

#define BD_POINT_NEIGHBOURS 8

// Shares are above 0, and 1 together.
struct bd_point_neighbours {
    uint32_t count; // 0: none lies within 16 times the points' distance from each other
    uint32_t point[BD_POINT_NEIGHBOURS];
    float share[BD_POINT_NEIGHBOURS];
};

// BD_ERR_NO_MEMORY, or what `pause` returns.
BD_MUST_CHECK
enum bd_err bd_point_tree_init(struct bd_point_tree *tree, const struct bd_surface_points *points,
                               enum bd_err (*pause)(void *user), void *user,
                               struct bd_err_detail *detail);
void bd_point_tree_finish(struct bd_point_tree *tree);

// At most that many, up to BD_POINT_NEIGHBOURS. Near ones have more. `normal` is unit.
void bd_point_tree_find(const struct bd_point_tree *tree, f3 position, f3 normal, uint32_t most,
                        struct bd_point_neighbours *out);

#endif
