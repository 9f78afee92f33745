// What each of some rays meets first (rays/rays.h): the other question beside visibility, asked of
// the device where the occluders lie there, and of the processor otherwise. Answers differ where a
// ray passes within rounding of a triangle's edge, and in the last digits of a distance. Or of
// environment maps instead (pass/env_rays.h).
//
// Cost: as visibility's on the processor. A device's walks begin anywhere, not with what is near: a
// ray costs it more than a segment does.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_NEAREST_H
#define BD_PASS_NEAREST_H

#include "pass/visibility.h"

// In slices of their own; `count` any. All are counted.
BD_MUST_CHECK
enum bd_err bd_nearest_ask(const struct bd_pass_context *context,
                           const struct bd_visibility_inputs *inputs, const struct bd_ray *rays,
                           size_t count, struct bd_ray_hit *hits, struct bd_ray_counts *traced,
                           struct bd_err_detail *detail);

#endif
