// What techniques share whose rays end in light that is told of places: a cache of irradiance
// (pass/far.h, pass/cache.h), cells of points, photons; and lobes and caustics of all of these.

#ifndef BD_TECHNIQUE_FAR_LIGHT_H
#define BD_TECHNIQUE_FAR_LIGHT_H

#include "pass/far.h"
#include "technique/technique.h"

// Noise of far rays is as white as they are few: 8.2, 5.4 and 6.3 % of the indirect mean in a box
// with four of either kind and 1, 2 and 3 levels; under a spot 13.1, 8.9 and 10.3; in
// Sponza 10.8, 9.6 and 9.8.
#define BD_FAR_FILTER_LEVELS 2u

// Of a receiver to a list's lights.
static inline uint32_t bd_chosen_rays(const struct bd_params *params)
{
    return params->rays < BD_RAYS_CHOSEN_MAX ? params->rays : BD_RAYS_CHOSEN_MAX;
}

// A quarter of the rays for what sub-frames behind the first light anew, whose noise is added up,
// and for lobes of rough dielectrics, which reflect some hundredths of their light. A quarter, half
// and all of 64 far rays for those, 16 sub-frames: 3.89, 3.80 and 3.78 % off under a spot.
#define BD_FEW_RAYS_SHARE 4u

static inline uint32_t bd_few_rays(uint32_t rays)
{
    const uint32_t few = rays / BD_FEW_RAYS_SHARE & ~1u;
    return few ? few : 2;
}

// Rays that end in whatever the technique has: what they carry, and what they meet.
struct bd_far_inputs bd_far_of(const struct bd_technique_inputs *inputs,
                               const struct bd_visibility_inputs *visibility, uint32_t rays);
// The same, that bring what the lights of a list leave out, soft or clamped.
struct bd_far_inputs bd_far_of_list(const struct bd_technique_inputs *inputs,
                                    const struct bd_visibility_inputs *visibility,
                                    const struct bd_vpl_list *list, uint32_t rays);

// The cache that they end in, in a pass "cache"; NULL where light is reflected but once.
BD_MUST_CHECK
enum bd_err bd_far_light_cache(const struct bd_pass_context *context,
                               const struct bd_technique_inputs *inputs,
                               const struct bd_gather_inputs *gather,
                               struct bd_irradiance_cells **out, struct bd_ray_counts *traced,
                               struct bd_err_detail *detail);

// Pixels of a later sub-frame that the first saw nothing of: some of the clamped lights, or where
// there are none of those of first light, and rays into that one's cache, in passes "gather" and
// "far".
BD_MUST_CHECK
bd_light_fragments_fn bd_far_light_pixels;

// What lamps send through glass, to pixels in a pass "caustics", or to fragments that have light.
BD_MUST_CHECK
enum bd_err bd_far_light_caustics(const struct bd_pass_context *context,
                                  const struct bd_technique_inputs *inputs,
                                  const struct bd_gather_inputs *gather,
                                  struct bd_indirect *indirect, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_far_light_add_caustics(const struct bd_pass_context *context,
                                      const struct bd_technique_inputs *inputs,
                                      const struct bd_gather_fragments_inputs *gather,
                                      struct bd_multires_light *light,
                                      struct bd_err_detail *detail);

// Of glossy and of rough receivers, in passes "gloss" and "rough". `far`: of the former.
BD_MUST_CHECK
enum bd_err bd_far_light_lobes(const struct bd_pass_context *context,
                               const struct bd_technique_inputs *inputs,
                               const struct bd_far_inputs *far,
                               const struct bd_gather_inputs *gather, struct bd_indirect *indirect,
                               struct bd_err_detail *detail);

// What blocks do not tell: lobes, which alone are smoothed, and caustics, at every pixel.
BD_MUST_CHECK
enum bd_err bd_far_light_beside(const struct bd_pass_context *context,
                                const struct bd_technique_inputs *inputs,
                                struct bd_indirect *indirect, struct bd_err_detail *detail);

// Of a later sub-frame all lobes anew, into the first one's cache, in passes "gloss" and "filter".
BD_MUST_CHECK
enum bd_err bd_far_light_anew(const struct bd_pass_context *context,
                              const struct bd_technique_inputs *inputs,
                              struct bd_indirect *indirect, struct bd_err_detail *detail);

#endif
