// What rays meet first as environment maps show it (pass/env_maps.h): the same questions as
// pass/nearest.h and pass/visibility.h, without an acceleration structure.
//
// Seen from a map's centre a ray runs along an arc. Where what the map shows lies before it on one
// side of a step and behind it on the other, it meets something in between, and false position
// finds where: after twelve steps, three looks do. A texel there names a triangle, whose plane
// gives the place; where the triangle is smaller than the texel, the texel's own place counts if
// the ray passes within two of them. The nearest of all maps is the answer. What no map shows is
// met by nothing.
//
// As printed (algorithms.md A5.3, A5.4): five looks from a guess on, without a bracket; taken is
// what lies within 2.56 degrees of the ray, and where the texel is. Of rays in a room of one
// material .82 to .92 are right, with brackets .996 to 1.
//
// Szirmay-Kalos, Aszodi, Lazanyi, Premecz 2005; Yao, Wang, Chan, Yong, Paul 2010, 5;
// Dowell and Jarratt 1971 (Illinois).
// Cost: .2 to .4 us a ray and map, of one core.
//
// Private to pass/. Thread: render thread, and the pool's.

#ifndef BD_PASS_ENV_RAYS_H
#define BD_PASS_ENV_RAYS_H

#include "pass/env_maps.h"
#include "pass/ray_walks.h"
#include "shared/rays.h"

// Who is asked instead of triangles.
struct bd_env_view {
    const struct bd_env_maps *maps;
    bool as_printed;
};

// In slices of their own, with the processor's threads; `count` any.
BD_MUST_CHECK
enum bd_err bd_env_rays_nearest(const struct bd_pass_context *context,
                                const struct bd_env_view *view, struct bd_pool *pool,
                                const struct bd_ray *rays, size_t count, struct bd_ray_hit *hits,
                                struct bd_ray_counts *traced);

// A bit of each segment, as in pass/visibility.h.
BD_MUST_CHECK
enum bd_err bd_env_rays_occluded(const struct bd_pass_context *context,
                                 const struct bd_env_view *view, struct bd_pool *pool,
                                 const struct bd_segment *segments, size_t count,
                                 uint32_t *occluded, struct bd_ray_counts *traced);

#endif
