// Light that goes round between points of surfaces. Each side looks about by four rays, once, and
// light is sent along what it saw until it changes no more. Sides of a small cell that see each
// other (pass/cells_of_sides.h) share what they get, so that little of it is noise; others keep
// their own, and nothing goes through a wall.
//
// As printed, places of cells look, each by points in a map of what it sees, and tell the cell.
//
// Private to pass/. Cost: four rays and as many searches a side, and four looks a round.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_POINT_CELLS_H
#define BD_PASS_POINT_CELLS_H

#include "lights/irradiance_cells.h"
#include "lights/point_lobes.h"
#include "pass/project_points.h"
#include "pass/visibility.h"

// Sides of points that light falls on, in whatever order.
struct bd_point_sides {
    uint32_t count;
    const struct bd_surface_point *places; // and what they send on
    const uint32_t *radiance_of;           // of each, in an array of radiances
    const f3 *first;                       // irradiance that is not reflected yet
    const struct bd_point_lobes *lobes;    // what some of them reflect by lobes, beside that
};

struct bd_point_cells_inputs {
    const struct bd_render_space *space;
    const struct bd_surface_hits *surfaces; // by which rays go on
    const struct bd_visibility_inputs *visibility;
    const struct bd_point_sides *sides;
    const struct bd_point_clusters *points; // whose radiance it is
    uint32_t cells, clusters, explore;      // at most; as struct bd_lit_points_inputs
    uint32_t rounds;                        // at most
    bool projected;                         // as printed: by maps of points, not by rays
    bool glass;                             // rays go through it
    uint64_t seed;
};

// What sides send of first light, into `radiance`.
BD_MUST_CHECK
enum bd_err bd_points_send_first(const struct bd_pass_context *context,
                                 const struct bd_point_sides *sides, f3 *radiance);

// Adds what they send of further light to that; `rounds`: how many it went.
BD_MUST_CHECK
enum bd_err bd_point_cells_run(const struct bd_pass_context *context,
                               const struct bd_point_cells_inputs *inputs, f3 *radiance,
                               struct bd_irradiance_cells **out, uint32_t *rounds,
                               struct bd_ray_counts *traced, struct bd_err_detail *detail);

#endif
