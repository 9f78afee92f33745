// Light that goes round between points of surfaces, in cells (lights/irradiance_cells.h) of places
// that a walk from lit points comes to: what nobody sees has none, or the insides of cupboards would
// be half of a kitchen's mean. One place of each looks about, once, and light is sent along what it
// saw until it changes no more.
//
// It looks by rays, that bring what the points next to their ends send; or as receivers do, by
// points in a map of what is seen, as Maletz, Wang and Bowers have it. Rays are the default: each
// reflection would lose what leaks between points.
//
// Private to pass/. Cost: 64 rays and as many searches a cell, and so many looks a round.
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
    const struct bd_scene *snapshot;
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
