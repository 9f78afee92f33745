// What techniques share that light the fragments of a picture and interpolate between them: only
// how the fragments are lit is their own.

#ifndef BD_TECHNIQUE_FRAGMENT_LIGHT_H
#define BD_TECHNIQUE_FRAGMENT_LIGHT_H

#include "pass/gather_fragments.h"
#include "technique/technique.h"

// The passes of a technique that lights fragments, in order.
// clang-format off
#define BD_FRAGMENT_PASSES                                                                         \
    {"weigh", BD_WHEN_CHOSEN}, {"choose", BD_WHEN_ASKED}, {"visibility", BD_WHEN_ASKED},             \
    {"gather", 0}, {"filter", BD_WHEN_FILTERED}, {"upsample", 0}
// clang-format on

// Whether irradiance vectors are asked for: not of light without room for them.
bool bd_fragments_have_vectors(const struct bd_params *params, const struct bd_unlit *unlit);

// Of a list of fragments; without visibility.
struct bd_gather_fragments_inputs bd_fragment_inputs(const struct bd_technique_inputs *inputs,
                                                     const struct bd_unlit *unlit);

// Each fragment sums all VPLs, or those that it sees.
BD_MUST_CHECK
bd_light_fragments_fn bd_fragments_gather;
// Each VPL is drawn to all fragments. Tells no spread.
BD_MUST_CHECK
bd_light_fragments_fn bd_fragments_splat;

// Lights them, then upsamples; what is done between is counted to `pass`. Wants BD_INPUT_FRAGMENTS.
// With a light_threshold those that light changes too much over are split and lit in their parts.
BD_MUST_CHECK
enum bd_err bd_fragment_light(const struct bd_pass_context *context,
                              const struct bd_technique_inputs *inputs, const char *pass,
                              bd_light_fragments_fn *light_fragments, struct bd_indirect **out,
                              struct bd_err_detail *detail);

#endif
