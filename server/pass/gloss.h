// Indirect light in specular lobes: what the whole BRDF of a pixel reflects beyond its diffuse
// lobe, by rays of the specular lobe and of the cosine, which share by the balance heuristic (Veach
// 1995). What a ray meets is lit there and then, by all lights and by a cache of irradiance:
// mirrors show what they should, and rough floors no points of light.
//
// Rays bring first light as the whole BRDF of what they meet reflects it, its lobe no narrower than
// the directions that a ray stands for; brushed metal on the way adds its own (pass/brushed.h).
// Lobes wider than a mirror's leave lamps behind glass and in mirrors to photons
// (pass/photon_density.h) where there are such.
//
// Of each pixel half of the rays make one picture and half another. Unbiased but for the cache, and
// but for what specular surfaces send on of other light, which counts as sent by diffuse ones.
// Cost: some .7 us of one core a ray, of pixels that have a lobe (conference room).
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_GLOSS_H
#define BD_PASS_GLOSS_H

#include "pass/far.h"

// `inputs->rays` of either kind. `points` and `area` are not read. Makes `glossy` and
// `noise_glossy` of `indirect`, which has neither; adds to its `rays`. In a pass "gloss".
BD_MUST_CHECK
enum bd_err bd_gloss_run(const struct bd_pass_context *context, const struct bd_far_inputs *inputs,
                         const struct bd_gather_inputs *gather, struct bd_indirect *indirect,
                         struct bd_err_detail *detail);

// The same of rough dielectrics, which all of the others are: what their specular lobe alone
// reflects, by rays of that alone. Makes `rough` and `noise_rough`. In a pass "rough".
BD_MUST_CHECK
enum bd_err bd_gloss_of_rough_run(const struct bd_pass_context *context,
                                  const struct bd_far_inputs *inputs,
                                  const struct bd_gather_inputs *gather,
                                  struct bd_indirect *indirect, struct bd_err_detail *detail);

// What pixels that show glass let through, and nothing else: where what is reflected is told by
// others. Places behind it are lit by `inputs->seen` beside first light. `*out`, the caller's, has
// `glossy`, `noise_glossy` and `rays` alone. In a pass "glass".
BD_MUST_CHECK
enum bd_err bd_gloss_of_glass_run(const struct bd_pass_context *context,
                                  const struct bd_far_inputs *inputs,
                                  const struct bd_gather_inputs *gather, struct bd_indirect **out,
                                  struct bd_err_detail *detail);

#endif
