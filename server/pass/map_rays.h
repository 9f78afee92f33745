// Rays through maps of what receivers see (pass/point_gather.h): each brings what is sent where it
// ends, over the chance that it was chosen by (kernel/map_rays.h). What the map has of light beyond
// the texels that they go through is added as far as those show what rays bring: all of it where
// the map is right, and then there is no noise; nothing where no ray brings what it shows, as where
// light leaks between points. So triangles hide light, and what a mirror shows comes from there.
//
// Lavenberg, Welch 1981 (control variates whose part is told by the samples); algorithms.md A4.
// Light is never below 0. Exact but for what points stand for, where rays are many.
//
// Private to pass/. Cost: a ray and a search for the nearest point each.
//
// Thread: render thread, and the pool's; texels are chosen by any.

#ifndef BD_PASS_MAP_RAYS_H
#define BD_PASS_MAP_RAYS_H

#include "lights/microbuffer.h"
#include "lights/surface_hits.h"
#include "pass/beside.h"
#include "pass/onward.h"
#include "pass/point_gather.h"
#include "pass/receivers.h"

// All zeroes but for what is set at first.
struct bd_map_rays {
    const struct bd_point_gather_inputs *inputs; // whose `rays` are more than 0
    const struct bd_microbuffer *map;
    // Of a part: each receiver's slots side by side, by its group and lane.
    struct bd_map_ray *chosen;
    struct bd_ray_counts traced;
    // Its own.
    const struct bd_receiver_part *part;
    struct bd_surface_hits surfaces;
    struct bd_beside beside;
    uint32_t count, *which; // of `chosen`, of each ray
    uint32_t *first_ray;    // of each group, and of none behind the last
    struct bd_ray *rays;
    struct bd_ray_hit *hits;
    uint32_t *numbers;
    f3 *weights;         // ways that they start along, times the solid angle that each stands for
    struct bd_way *ways; // with glass; else NULL
};

// Of a receiver, which not all are used. In the mean `inputs->rays` are.
static inline uint32_t bd_map_ray_slots(const struct bd_point_gather_inputs *inputs)
{
    return BD_MAP_RAY_SLOTS(inputs->rays);
}

// Receivers whose rays may be on their way at once.
uint32_t bd_map_rays_at_once(const struct bd_point_gather_inputs *inputs);

// No receiver of the part has any yet. The first part is the largest. BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_map_rays_begin(struct bd_map_rays *rays, const struct bd_receiver_part *part,
                              struct bd_err_detail *detail);

// Of a receiver, by what each of its texels shows and what that gives, of all channels, under its
// `normal`, which is in the map's axes: `gives`, which is used up. `by`: its chance.
void bd_map_rays_choose(const struct bd_map_rays *rays, f3 normal, const uint32_t *seen,
                        float *gives, uint32_t by, struct bd_map_ray *chosen);

// Adds what they bring to the part's light.
BD_MUST_CHECK
enum bd_err bd_map_rays_run(const struct bd_pass_context *context, struct bd_map_rays *rays,
                            struct bd_err_detail *detail);
void bd_map_rays_finish(struct bd_map_rays *rays);

#endif
