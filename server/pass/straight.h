// Light that goes straight through glass between a place and a light (lights/interface.h), and
// through what blends, as far as that is not opaque: what segments and rays that look for lights
// bring, beside what nothing hides. Rays meet what blends as often as it is opaque.
//
// Of a segment that something hides its triangles are asked one after the other: it passes where
// all of them are glass that lets it, by a part of each colour. Exact for panes, which turn
// nothing. Of who looks so nobody else may bring that light (`straight` of pass/onward.h).
//
// Cost: of each segment that something hides a ray more, and one for each wall that it passes.
//
// Private to pass/. Thread: any, but for those that have a context.

#ifndef BD_PASS_STRAIGHT_H
#define BD_PASS_STRAIGHT_H

#include "pass/visibility.h"

// Walls that a straight way goes through at most; behind more of them it is dark.
#define BD_STRAIGHT_WALLS_MAX 24u

// What comes along a segment that something hides, of each colour.
f3 bd_straight_along(const struct bd_visibility_inputs *visibility,
                     const struct bd_segment *segment);

// Clears bits of segments that something hides as often as light passes them: of its colours the
// mean. Without a context: all threads of the pool at once.
void bd_straight_by_chance(const struct bd_visibility_inputs *visibility,
                           const struct bd_segment *segments, size_t count, uint32_t *occluded);

// As bd_visibility_ask, and what segments bring is less by the glass between: of each `parts` of
// `brought`. A bit is set where nothing comes. In slices of their own.
BD_MUST_CHECK
enum bd_err bd_straight_ask(const struct bd_pass_context *context,
                            const struct bd_visibility_inputs *visibility,
                            const struct bd_segment *segments, size_t count, uint32_t *occluded,
                            f3 *brought, uint32_t parts, struct bd_ray_counts *traced,
                            struct bd_err_detail *detail);

// As bd_nearest_ask, and rays go on through panes: hits are what lies behind those, their distance
// from the ray's origin, and `passed` is of each colour what passes.
BD_MUST_CHECK
enum bd_err bd_straight_nearest(const struct bd_pass_context *context,
                                const struct bd_visibility_inputs *visibility,
                                const struct bd_ray *rays, size_t count, struct bd_ray_hit *hits,
                                f3 *passed, struct bd_ray_counts *traced,
                                struct bd_err_detail *detail);

#endif
