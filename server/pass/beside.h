// What stands for where rays end, a point or a cell: the nearest that a ray's end sees, straight,
// or over the surface that both lie on where that bends away; if an end sees none, the nearest that
// the ray's start sees. So light on one side of a thin wall is never taken for the other side's.
//
// Private to pass/. Cost: a search and a short segment a ray, of bent surfaces two; of rays whose
// nearest is hidden another search, and a segment for each that is, fifteen at most.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_BESIDE_H
#define BD_PASS_BESIDE_H

#include "lights/irradiance_cells.h"
#include "lights/point_clusters.h"
#include "lights/surface_hits.h"
#include "pass/visibility.h"

// On a surface, render space; `normal` is unit.
struct bd_beside_place {
    f3 position, normal;
};

// Two segments: places see each other if both are free. Where neither place lies under the other's
// plane the second has no length.
void bd_way_beside(struct bd_segment way[2], const struct bd_beside_place *a,
                   const struct bd_beside_place *b);

// All zeroes but for what is set at first. Its room grows as it is asked for.
struct bd_beside {
    const struct bd_point_clusters *points; // or NULL: cells
    const struct bd_irradiance_cells *cells;
    const struct bd_visibility_inputs *visibility;
    const struct bd_surface_hits *surfaces;
    // Of each ray as bd_point_clusters_near, or a cell; BD_BESIDE_NONE; or BD_BESIDE_HIDDEN where
    // there are some, all hidden, or no cell: other rays tell more of what such a ray brings than
    // nothing does.
    uint32_t *near;
#define BD_BESIDE_NONE   UINT32_MAX
#define BD_BESIDE_HIDDEN (BD_BESIDE_NONE - 1)
    // Its own.
    const struct bd_ray *rays;
    const struct bd_ray_hit *hits;
    struct bd_beside_place *ends;
    uint32_t *asking; // rays that look for a point
    uint32_t count, room, looks;
    uint8_t *found;              // points for each ray
    uint32_t *sides;             // those: BD_NEAREST_MOST of each
    struct bd_segment *segments; // two for each
    uint32_t *hidden;
};

// On the side that a ray comes to; nothing stands where it meets nothing that sends light on.
// BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_beside_find(const struct bd_pass_context *context, struct bd_beside *beside,
                           const struct bd_ray *rays, const struct bd_ray_hit *hits, uint32_t count,
                           struct bd_ray_counts *traced, struct bd_err_detail *detail);
void bd_beside_finish(struct bd_beside *beside);

#endif
