// Points on surfaces, sorted by the way that they face: trees of those that face alike
// (lights/point_tree.h), so that who looks for such passes by all others at once. Beside a floor
// full of photons a wall has none, and would look at all of the floor's for it.
//
// A function of the points and their order. Cost: that of one tree.
//
// Private to lights/. Thread: built by one, then read by all.

#ifndef BD_LIGHTS_FACING_TREES_H
#define BD_LIGHTS_FACING_TREES_H

#include "lights/point_tree.h"

#define BD_FACINGS 96u // of six faces, each 4 x 4

struct bd_facing {
    f3 axis;            // that its points' normals lie about
    float cosine, sine; // of the widest angle between them
    struct bd_point_tree tree;
    uint32_t *numbers; // of its points
};

struct bd_facing_trees {
    uint32_t count; // of points
    float area;     // that each stands for
    struct bd_facing facings[BD_FACINGS];
};

// BD_ERR_NO_MEMORY, or what `pause` returns.
BD_MUST_CHECK
enum bd_err bd_facing_trees_init(struct bd_facing_trees *trees,
                                 const struct bd_surface_points *points,
                                 enum bd_err (*pause)(void *user), void *user,
                                 struct bd_err_detail *detail);
void bd_facing_trees_finish(struct bd_facing_trees *trees);
uint64_t bd_facing_trees_bytes(const struct bd_facing_trees *trees);

// Whether some of its points may face within that cosine of the normal; whether all do.
bool bd_facing_has_alike(const struct bd_facing *facing, f3 normal, float cosine);
bool bd_facing_is_alike(const struct bd_facing *facing, f3 normal, float cosine);

#endif
