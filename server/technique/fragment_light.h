// What techniques share that light the fragments of a picture and interpolate between them: only
// how the fragments are lit is their own.

#ifndef BD_TECHNIQUE_FRAGMENT_LIGHT_H
#define BD_TECHNIQUE_FRAGMENT_LIGHT_H

#include "pass/gather_fragments.h"
#include "technique/technique.h"

typedef enum bd_err bd_light_fragments_fn(const struct bd_pass_context *context,
                                          const struct bd_gather_fragments_inputs *inputs,
                                          struct bd_multires_light **out, struct bd_fault *fault);

// Lights them in a pass of that name, then upsamples. Wants BD_INPUT_FRAGMENTS. Where they are lit by
// bd_gather_fragments_run, those that light changes too much over are split and lit in their parts
// (light_threshold).
BD_MUST_CHECK
enum bd_err bd_fragment_light(const struct bd_pass_context *context,
                              const struct bd_technique_inputs *inputs, const char *pass,
                              bd_light_fragments_fn *light_fragments, struct bd_indirect **out,
                              struct bd_fault *fault);

// The second half by itself: from fragments that are lit to every pixel. Destroys `lit`.
BD_MUST_CHECK
enum bd_err bd_fragment_light_spread(const struct bd_pass_context *context,
                                     const struct bd_technique_inputs *inputs,
                                     struct bd_multires_light **lit, struct bd_indirect **out,
                                     struct bd_fault *fault);

#endif
