// From where a few environment maps see the most of a scene (pass/env_maps.h).
//
// Of places spread over its bounds those are candidates that do not look at rears: such lie in
// solid matter, or behind the walls. Of each a small cube is looked at; chosen is who sees the
// largest area that none of those chosen sees; then, as long as more is seen for it, one is added
// and the one dropped that sees the least for itself. Where no candidate sees more, there are
// fewer maps than asked for.
//
// Yao, Wang, Chan, Yong, Paul 2010, 4.1 and 4.2 (algorithms.md A5.1, P1). Cost: 40 cubes of 32
// texels, drawn or traced, and some 100 ms of one core.
//
// Private to pass/. Thread: render thread, and the pool's.

#ifndef BD_PASS_ENV_CHOICE_H
#define BD_PASS_ENV_CHOICE_H

#include "pass/env_maps.h"

struct bd_env_choice {
    uint32_t count; // at most as many as asked for; at least 1
    f3 centres[BD_ENV_MAPS_MAX];
    float covered;           // area that they see, render units squared
    uint32_t tried, refused; // places
};

// Of `inputs`: scene, choice_tracer, count and seed.
BD_MUST_CHECK
enum bd_err bd_env_choose(const struct bd_pass_context *context,
                          const struct bd_env_maps_inputs *inputs,
                          const struct bd_surface_hits *hits, struct bd_env_choice *out,
                          struct bd_err_detail *detail);

#endif
