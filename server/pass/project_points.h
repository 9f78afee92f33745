// What a place sees over its plane: points of all surfaces in a small map
// (kernel/projected_point.h), drawn where they may give much (Maletz, Wang, Bowers 2011;
// algorithms.md A4).
//
// A few of each cluster say what it may give (explore), and by that it has its share of the others
// (exploit): systematically, so that each has its part of them but for one, whatever it is; a tenth
// goes to all alike, so that nothing is never looked at. Those of a cluster are spread over it, and
// each stands for as much of its area as any.
//
// Whatever is left to chance is drawn by names, of points and clusters, that they keep where others
// come or go; and where a cluster is drawn from once more, all that were drawn stay: a picture
// changes little where a scene does. Integers decide who is drawn, and a texel keeps the least of
// keys: no order of threads shows. A texel that no point covers, among others that some do, sees
// what one of those sees.
//
// Private to pass/. Cost: 18 to 28 ns a point of one core.
//
// Thread: any; prepared by one, then read by all.

#ifndef BD_PASS_PROJECT_POINTS_H
#define BD_PASS_PROJECT_POINTS_H

#include "lights/point_clusters.h"
#include "pass/native/native.h"

// Which points a map is asked of.
enum bd_projection {
    BD_PROJECTION_IMPORTANCE,
    BD_PROJECTION_UNIFORM, // as many, of all clusters alike: for comparison
    BD_PROJECTION_ALL,     // every one: what the others are compared with
};

#define BD_EXPLORE_MAX 8u

struct bd_projector {
    const struct bd_native_loops *loops;
    const struct bd_point_clusters *points;
    uint32_t explore, exploit; // of each cluster, 1 to BD_EXPLORE_MAX; of all
    uint32_t side;             // texels
    enum bd_projection projection;
    // The paper's counts, points that stand for all of their cluster twice, its solid angles, and
    // holes where they leave some.
    bool as_printed;
};

#define BD_SEES_NOTHING UINT32_MAX
// What was seen, of each texel: twice a point's place in the order, and 1 if it was its back; and a
// thread's room for looking.
struct bd_projected {
    uint32_t point[BD_MICROBUFFER_SIDE_MAX * BD_MICROBUFFER_SIDE_MAX];
    uint32_t map[BD_MICROBUFFER_SIDE_MAX * BD_MICROBUFFER_SIDE_MAX];
    uint32_t of_slot[BD_MICROBUFFER_SIDE_MAX * BD_MICROBUFFER_SIDE_MAX]; // of fewer slots
    uint32_t drawn[BD_CLUSTERS_MAX], shares[BD_CLUSTERS_MAX];
    float importance[BD_CLUSTERS_MAX];
    struct bd_native_points row;
    uint32_t row_names[BD_LANES]; // points, or clusters
    uint32_t first_slot;
};

// Axes about a normal, turned about it by chance, so that neighbours' maps differ.
struct bd_native_place bd_projected_place(f3 position, f3 normal, uint32_t chance);

// `cut`: of the points, as somebody near the place sees them. `chance`: any number that others have
// not.
void bd_project_points(const struct bd_projector *projector, const struct bd_point_cut *cut,
                       const struct bd_native_place *place, uint32_t chance,
                       struct bd_projected *seen);

#endif
