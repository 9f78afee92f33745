// Point lamps and spots that are nearer to surfaces than points there are to each other: what one
// sends to so small a part is all of a point's light or none of it, as points happen to lie. Rays
// that share its flux evenly land on the points about that it sees instead, so that all of it falls
// somewhere, and none behind a thin wall, as far as NEAR_REACH of them; what lies beyond is lit as
// ever (pass/first_light.h).
//
// A lamp that has glass as near is left as it was: what lands on a pane is not a point's behind it.
//
// Private to pass/. Cost: a nearest point for each lamp; of those that are near at most 1,024 rays,
// and as many segments.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_NEAR_LAMPS_H
#define BD_PASS_NEAR_LAMPS_H

#include "lights/point_clusters.h"
#include "pass/visibility.h"
#include "shared/light.h"

struct bd_near_lamps_inputs {
    const struct bd_scene *snapshot;
    const struct bd_visibility_inputs *visibility;
    const struct bd_point_clusters *points;
    const struct bd_light_uniform *punctuals;
    uint32_t count;
    bool glass; // light goes through it
    uint64_t seed;
};

struct bd_near_lamps {
    // Of each lamp the square of how far it lands, 0 of those that are not near; NULL: none is.
    float *reach2;
    f3 *irradiance; // of each point's front and back, in order, of what lands there; or NULL
};

BD_MUST_CHECK
enum bd_err bd_near_lamps_run(const struct bd_pass_context *context,
                              const struct bd_near_lamps_inputs *inputs, struct bd_near_lamps *out,
                              struct bd_ray_counts *traced, struct bd_err_detail *detail);
void bd_near_lamps_finish(struct bd_near_lamps *near);

#endif
