// Points of all surfaces with the light that they send (Maletz, Wang, Bowers 2011; algorithms.md
// A4), in clusters, to be projected (pass/project_points.h).
//
// First light of all kinds is asked for by rays at every point, of double-sided surfaces at both of
// its sides. What is reflected more often goes round between points (pass/point_cells.h).
//
// A function of the snapshot, its lights and these numbers, and not of a camera. In passes
// "points" and "point_clusters".
//
// Cost: 7, 15, 19 us a point and core (Cornell box, Sponza, kitchen_lux).
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_LIT_POINTS_H
#define BD_PASS_LIT_POINTS_H

#include "lights/irradiance_cells.h"
#include "lights/photon_map.h"
#include "lights/point_clusters.h"
#include "lights/point_lobes.h"
#include "pass/first_light.h"

struct bd_lit_points_inputs {
    const struct bd_render_space *space;
    const struct bd_scene *snapshot;
    struct bd_visibility_inputs visibility;
    struct bd_first_light first;
    uint32_t count, clusters, cells; // points: 1 to BD_SURFACE_POINTS_MAX; clusters, cells at most
    uint32_t reflections;            // of light, before the last: 1 to 64
    uint32_t explore;                // of a cluster, as cells look (pass/project_points.h)
    bool projected;                  // as printed: cells look by maps of points, not by rays
    bool lambert;                    // surfaces send on their base colour, evenly
    bool glass;                      // light goes through it: it hides nothing
    uint32_t photons;                // that lamps send through glass; 0: none
    uint64_t seed;
};

struct bd_lit_points {
    struct bd_point_clusters clusters;
    f3 *radiance; // of each point's front and back, in order, sent evenly; frame's unit
    struct bd_point_lobes lobes;       // what some of those send beside that
    struct bd_irradiance_cells *cells; // what of it was reflected before; NULL: nothing
    struct bd_photon_map *caustics;    // or NULL
    uint32_t rounds;                   // that light went
    struct bd_ray_counts traced;
};

BD_MUST_CHECK
enum bd_err bd_lit_points_run(const struct bd_pass_context *context,
                              const struct bd_lit_points_inputs *inputs, struct bd_lit_points **out,
                              struct bd_err_detail *detail);
void bd_lit_points_destroy(struct bd_gpu *gpu, struct bd_lit_points **points);

// Radiance of a point's front, 2 i, or back, 2 i + 1, to a viewer, unit.
f3 bd_lit_points_send(const struct bd_lit_points *points, uint32_t side, f3 to_viewer);
// To a place, render space.
f3 bd_lit_points_send_to(const struct bd_lit_points *points, uint32_t side, f3 place);

uint64_t bd_lit_points_bytes(const struct bd_lit_points *points);

#endif
