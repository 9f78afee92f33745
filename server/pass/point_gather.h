// Light of points of all surfaces at receivers: each projects some into a map of what it sees
// (pass/project_points.h), and sums what they send by the texels that they keep (algorithms.md A4).
//
// Of blocks, if asked for, how far off light may be that is interpolated over them
// (kernel/light_spread.h), of which what texels show is a patch each.
//
// Exact but for the map: what is nearer than a texel's width to an edge may lie on its other side,
// and holes between points show what lies behind them. Rays through some texels say how far off it
// is (pass/map_rays.h).
//
// Cost: 57 to 87 us a receiver and core at 3,072 points (192x192, Cornell boxes, Sponza), and half
// to all of that again for 64 rays.
//
// Maletz, Wang, Bowers 2011. Thread: render thread, and the pool's.

#ifndef BD_PASS_POINT_GATHER_H
#define BD_PASS_POINT_GATHER_H

#include "pass/gather_fragments.h"
#include "pass/lit_points.h"
#include "pass/project_points.h"

struct bd_point_gather_inputs {
    const struct bd_lit_points *points;
    uint32_t explore, exploit, side; // as of struct bd_projector
    uint32_t clusters;               // of a set of receivers (pass/receiver_sets.h)
    // As the paper has it: even clusters, the same for all; counts, solid angles and holes (struct
    // bd_projector); texels alike, that hold radiance in eight bits.
    bool as_printed;
    enum bd_projection projection;
    uint32_t rays; // of a receiver through its map, even, at most BD_MAP_RAYS_MAX; 0: none
    const struct bd_scene *snapshot;               // that they meet,
    const struct bd_visibility_inputs *visibility; // and as they do
    bool glass;                                    // they go on through it, and from mirrors
    bool noise; // of light that is made is kept, too (pass/filter_fragments.h)
    struct bd_pool *pool;
    uint64_t seed;
};

// Where a receiver's map lies, and what chance has for it. Private to pass/.
struct bd_native_place bd_point_gather_place(const struct bd_point_gather_inputs *inputs,
                                             const struct bd_ray_starts *starts, uint32_t lane);
// Of the slicer, that a receiver takes. Private to pass/.
double bd_point_gather_units(const struct bd_point_gather_inputs *inputs);

// Of fragments, in a pass "project": into `gather->into`, or into a light that is made.
BD_MUST_CHECK
enum bd_err bd_point_gather_of_fragments(const struct bd_pass_context *context,
                                         const struct bd_point_gather_inputs *inputs,
                                         const struct bd_gather_fragments_inputs *gather,
                                         struct bd_multires_light **out,
                                         struct bd_err_detail *detail);

#endif
