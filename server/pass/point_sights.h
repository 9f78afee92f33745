// What places see of points, to be summed as often as those' radiance changes: by rays, each of
// which brings what the point sends that stands for its end; or as receivers do, by points in a map
// of what is seen, as Maletz, Wang and Bowers have it.
//
// Private to pass/. Cost: of each ray as pass/beside.h; of a map as pass/project_points.h.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_POINT_SIGHTS_H
#define BD_PASS_POINT_SIGHTS_H

#include "lights/surface_hits.h"
#include "pass/point_cells.h"

// A side of a point, and how much of its radiance comes as irradiance.
struct bd_point_sight {
    uint32_t side;
    float weight;
};

// All zeroes, then what was seen.
struct bd_point_sights {
    uint32_t count, each;          // places; sights of each
    struct bd_point_sight *sights; // those of weight 0 are none
    f3 *of_lobes;                  // irradiance by lobes of the points that each sees
};

// Places draw by their numbers. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_point_sights_by_rays(const struct bd_pass_context *context,
                                    const struct bd_point_cells_inputs *inputs,
                                    const struct bd_surface_point *places, uint32_t count,
                                    uint32_t rays, struct bd_point_sights *sights,
                                    struct bd_ray_counts *traced, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_point_sights_by_maps(const struct bd_pass_context *context,
                                    const struct bd_point_cells_inputs *inputs,
                                    const struct bd_surface_point *places, uint32_t count,
                                    struct bd_point_sights *sights, struct bd_err_detail *detail);

// Adds up all that comes to each: irradiance.
BD_MUST_CHECK
enum bd_err bd_point_sights_sum(const struct bd_pass_context *context,
                                const struct bd_point_sights *sights, const f3 *radiance,
                                f3 *irradiance);
void bd_point_sights_finish(struct bd_point_sights *sights);

#endif
