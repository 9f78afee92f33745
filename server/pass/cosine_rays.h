// Rays that go from receivers as a diffuse surface looks, and what they meet. Private to pass/.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_COSINE_RAYS_H
#define BD_PASS_COSINE_RAYS_H

#include "lights/sequence.h"
#include "pass/onward.h"
#include "pass/receivers.h"

#define BD_COSINE_HALVES 2u

// All zeroes but for what is set at first.
struct bd_cosine_rays {
    uint32_t of_receiver; // even: of both halves in turn
    uint64_t seed;
    uint32_t one_of; // of so many receivers, a power of two, one sends any; spread evenly
    float reach;     // of rays, render units; 0: as far as there is anything
    // Of receivers who need none, or NULL; with `user`, from several threads.
    bool (*needs_none)(const void *user, f3 position);
    const void *user;
    const struct bd_surface_hits *glass; // of a scene where rays go on through that; or NULL
    // Of pixels that show glass every other ray goes into it, as whoever looks does; wants `glass`,
    // and parts that have surfaces.
    bool enters;
    // Of pixels that show what blends every other ray goes behind it, where other sub-frames look;
    // or NULL.
    const struct bd_surface_hits *veils;
    // Of a part: its groups' rays side by side.
    uint32_t count;
    struct bd_ray *rays;
    struct bd_ray_hit *hits;
    struct bd_way *ways;             // with glass, of each ray; else NULL
    uint8_t *lanes;                  // of each ray, times the halves, and which half
    uint32_t *numbers;               // of each ray, its receiver's rays side by side: no other's
    uint32_t *ray_count, *first_ray; // of each group
    struct bd_ray_counts traced;
    // Its own.
    struct bd_sequence sequence[BD_COSINE_HALVES];
    uint32_t stride;
    float view_reach;
    const struct bd_receiver_part *part;
};

// Bytes of a group's rays.
size_t bd_cosine_rays_bytes(const struct bd_cosine_rays *rays);

// The first part is the largest. BD_ERR_NO_MEMORY, or what the slicer's pause returns.
BD_MUST_CHECK
enum bd_err bd_cosine_rays_trace(const struct bd_pass_context *context, struct bd_cosine_rays *rays,
                                 const struct bd_receiver_part *part,
                                 const struct bd_visibility_inputs *visibility,
                                 struct bd_err_detail *detail);
void bd_cosine_rays_finish(struct bd_cosine_rays *rays);

#endif
