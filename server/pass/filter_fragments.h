// Smooths what few rays leave noisy at fragments, before light is interpolated between them: along
// surfaces, over blocks of one level, and as far as its noise goes.
//
// Cost: 50 blocks looked at a fragment, and its light's textures a second time.

#ifndef BD_PASS_FILTER_FRAGMENTS_H
#define BD_PASS_FILTER_FRAGMENTS_H

#include "pass/gather_fragments.h"

// `lists` are all that are lit. Light with noise (bd_multires_light) of inputs->gather's picture, of
// which `variance_part` counts (image/light_filter.h); replaced by one without. On failure it stays.
BD_MUST_CHECK
enum bd_err bd_filter_fragments_run(const struct bd_pass_context *context,
                                    const struct bd_gather_fragments_inputs *inputs,
                                    const struct bd_fragments *const *lists, uint32_t list_count,
                                    float variance_part, struct bd_multires_light **light,
                                    struct bd_err_detail *detail);

#endif
