// Points of surfaces in clusters: halves of halves of space, along one axis after the other, as far
// as points lie in both, down to a 1,024th of all. What is moved changes none that it does not
// enter or leave: where planes lie is no matter of points. Points of a part lie side by side,
// neighbours near each other.
//
// A cut of the tree is of as many parts as are asked for, of the same solid angle as receivers in a
// box see them, so that what is near is of many (algorithms.md A4); or the points in order are cut
// into as many of the same number, as the paper has it but for who is whose neighbour.
//
// A function of the points. Cost: of making it, three rounds of sorting and a walk; of a cut, a
// heap of as many parts.
//
// Maletz, Wang, Bowers 2011; Lauterbach et al. 2009 (trees by Morton codes). Thread: made by one,
// then read by all.

#ifndef BD_LIGHTS_POINT_CLUSTERS_H
#define BD_LIGHTS_POINT_CLUSTERS_H

#include "lights/surface_points.h"
#include "shared/projected_points.h"

struct bd_point_box {
    f3 least, most;
};

// Its halves are the next part and `second`, 0 where it has none. `name`: that it keeps whatever
// becomes of others. Steps of `step` through it, round and round, come to each of its points once,
// and wherever they stop have spread over it.
struct bd_point_part {
    struct bd_point_box box;
    uint32_t first, count, second, name, step;
};

struct bd_point_clusters {
    uint32_t count;
    float area;                        // that each point stands for, render units squared
    struct bd_projected_point *points; // in order
    uint32_t *order;                   // of each which of the points it is
    uint32_t *names;                   // of each, that it keeps whatever becomes of others
    struct bd_point_part *parts;       // the first is all of them
    uint32_t part_count;
};

// From where points are seen: anywhere in a box, over planes with that normal, if they have one.
struct bd_point_view {
    struct bd_point_box box;
    f3 normal; // unit, or 0: any
};

// A view that is made of receivers one by one.
struct bd_points_about {
    uint32_t count;
    struct bd_point_view view;
};
void bd_points_about_add(struct bd_points_about *about, f3 position, f3 normal);

struct bd_point_cut {
    uint32_t count;
    struct bd_point_cluster clusters[BD_CLUSTERS_MAX];
};

// `pause` as in lights/point_tree.h. BD_ERR_NO_MEMORY, or what `pause` returns.
BD_MUST_CHECK
enum bd_err bd_point_clusters_init(struct bd_point_clusters *clusters,
                                   const struct bd_surface_points *points,
                                   enum bd_err (*pause)(void *user), void *user,
                                   struct bd_err_detail *detail);
void bd_point_clusters_finish(struct bd_point_clusters *clusters);

// At most `most` clusters, 1 to BD_CLUSTERS_MAX, which hold all points: fewer where there are fewer
// parts. `view`: NULL, those of as many points. In the order of the points.
void bd_point_clusters_cut(const struct bd_point_clusters *clusters, uint32_t most,
                           const struct bd_point_view *view, struct bd_point_cut *cut);

// The nearest point to a place that faces as it does, on its front or back: twice its place in the
// order, and 1 for the back; or BD_NO_POINT_NEAR where none lies within `reach`. What lies off the
// place's plane is ten times as far. `normal`: unit, or 0 of a place that faces all ways.
#define BD_NO_POINT_NEAR UINT32_MAX
uint32_t bd_point_clusters_near(const struct bd_point_clusters *clusters, f3 position, f3 normal,
                                float reach);

// The same, the `most` nearest, 1 to BD_NEAREST_MOST, in order; how many.
#define BD_NEAREST_MOST 8u
uint32_t bd_point_clusters_nearest(const struct bd_point_clusters *clusters, f3 position, f3 normal,
                                   float reach, uint32_t *sides, uint32_t most);

// All that face so and lie within `reach`, the first `most` of them if there are more; how many.
uint32_t bd_point_clusters_within(const struct bd_point_clusters *clusters, f3 position, f3 normal,
                                  float reach, uint32_t *sides, uint32_t most);

#endif
