// Where light comes to that goes round between points (pass/point_cells.h): a walk by rays, from
// points that are lit to where those end, and on. As many go on from each region of space, and of
// the ways that surfaces face, whether many came there or few.
//
// Private to pass/. Cost: eight rays a cell and step.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_POINT_WALK_H
#define BD_PASS_POINT_WALK_H

#include "pass/point_cells.h"

// All zeroes but for what is set at first.
struct bd_point_walk {
    const struct bd_point_cells_inputs *inputs;
    const struct bd_surface_hits *hits;
    const f3 *radiance;              // that sides send
    struct bd_surface_point *places; // that it came to; room for as many more as there are sides
    uint32_t count;
    // Who looks along a ray; room for as many as there are sides.
    struct bd_surface_point *starts;
    // Its own.
    struct bd_ray *rays;
    struct bd_ray_hit *met;
};

BD_MUST_CHECK
enum bd_err bd_point_walk_run(const struct bd_pass_context *context, struct bd_point_walk *walk,
                              struct bd_ray_counts *traced, struct bd_err_detail *detail);
void bd_point_walk_finish(struct bd_point_walk *walk);

// The first of `starts` look about, one way each; and whether one of them sees a surface.
BD_MUST_CHECK
enum bd_err bd_point_walk_look(const struct bd_pass_context *context, struct bd_point_walk *walk,
                               uint32_t count, struct bd_ray_counts *traced,
                               struct bd_err_detail *detail);
bool bd_point_walk_sees(const struct bd_point_walk *walk, uint32_t start,
                        struct bd_surface_point *seen);

// Of light with that irradiance what a side sends on evenly: radiance.
f3 bd_point_side_sends(const struct bd_point_sides *sides, uint32_t side, f3 irradiance);

#endif
