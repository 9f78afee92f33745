// What pixels that show glass let through, for techniques that follow no light: the others see it
// by their own rays (pass/gloss.h).

#ifndef BD_TECHNIQUE_GLASS_LIGHT_H
#define BD_TECHNIQUE_GLASS_LIGHT_H

#include "technique/technique.h"

// `visibility` and `rays` of a pixel: even, at least 2. Of all places behind glass that they meet:
// light of lamps, emitters and the sky, and of a few of the
// technique's virtual lights, where it has any (`vpls_in_order`). `*out`, the caller's, has
// `glossy`, `noise_glossy` and `rays` alone. In a pass "glass".
BD_MUST_CHECK
enum bd_err bd_glass_light(const struct bd_pass_context *context,
                           const struct bd_technique_inputs *inputs,
                           const struct bd_visibility_inputs *visibility, uint32_t rays,
                           struct bd_indirect **out, struct bd_err_detail *detail);

#endif
