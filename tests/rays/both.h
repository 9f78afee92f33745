// Segments and rays asked of the processor and of the device, and what the exact answer is where
// those two differ.

#ifndef BD_TESTS_RAYS_BOTH_H
#define BD_TESTS_RAYS_BOTH_H

#include "pass/nearest.h"
#include "pass/visibility.h"
#include "scene/model/scene.h"

enum executor { PROCESSOR, DEVICE, EXECUTOR_COUNT };

struct both {
    struct bd_pass_context context;
    struct bd_slicer slicer;
    struct bd_pool *pool;
    struct bd_ray_nodes *nodes; // what the device has
    struct bd_occluders *occluders[EXECUTOR_COUNT];
    double built_ms[EXECUTOR_COUNT];
    uint64_t chances; // state of random numbers
};

// A device, as $BOUNCED_TEST_DEVICE says or `auto`; ends the process with 77 where there is none.
void both_open(struct both *both);
void both_close(struct both *both);
// Retains the scene. BD_ERR_UNSUPPORTED where it is the processor's alone; nothing is made then.
enum bd_err both_take(struct both *both, struct bd_scene *scene, struct bd_err_detail *detail);
void both_drop(struct both *both);

// Bits as of bd_rays_occluded, of (count + 31) / 32 words and one behind, which must stay as it is;
// how many were asked, and in which time.
struct bd_ray_counts both_ask(struct both *both, enum executor executor, enum bd_rays_alpha alpha,
                              const struct bd_segment *segments, size_t count, uint32_t *bits);

// Hits as of bd_rays_nearest.
struct bd_ray_counts both_meet(struct both *both, enum executor executor, enum bd_rays_alpha alpha,
                               const struct bd_ray *rays, size_t count, struct bd_ray_hit *hits);

// In [0, 1).
double both_chance(struct both *both);
// Segments of three kinds in turns: between points of triangles, whose numbers they have; between
// any points of the scene's box; along an axis.
void both_choose(struct both *both, struct bd_segment *segments, size_t count);
// Rays from points of triangles to any points, and along the other kinds, for nine tenths of the
// way or to no end; of three, one begins later on.
void both_choose_rays(struct both *both, struct bd_ray *rays, size_t count);

// Whether no triangle surely blocks the segment, but one would, or would be seen from its other
// side, with ends a few units in the last place away: it passes by an edge, or in a plane, or
// where alpha (BD_RAYS_ALPHA_MASK) begins.
// Or it is smaller than 32 bits have products for: 1e-10 of the scene.
bool both_is_close(struct both *both, const struct bd_segment *segment);

struct differences {
    size_t count, unexplained, first_unexplained;
};
struct differences both_compare(struct both *both, const struct bd_segment *segments, size_t count,
                                const uint32_t *a, const uint32_t *b);
// Other triangles; explained where both are as near, or the segment to the nearer one is close. The
// same triangle at other distances is explained in the same way, and not counted. Rays pass no
// backs.
struct differences both_compare_hits(struct both *both, const struct bd_ray *rays, size_t count,
                                     const struct bd_ray_hit *a, const struct bd_ray_hit *b);

#endif
