// Indirect light of the second and later sub-frames of an antialiased frame, for techniques that
// can light single pixels: what the first sub-frame has is interpolated (pass/shared_light.h), and
// pixels that it saw nothing of are lit by themselves.

#ifndef BD_TECHNIQUE_SUB_FRAME_LIGHT_H
#define BD_TECHNIQUE_SUB_FRAME_LIGHT_H

#include "technique/technique.h"

// What the first sub-frame left. Borrowed.
struct bd_first_sub_frame {
    const struct bd_viewpoint *viewpoint;
    struct bd_pixel_blocks blocks; // that are its pixels
    const struct bd_gbuffer *gbuffer;
    const struct bd_indirect *indirect;
};

// Whether a technique's sub-frames share light with these parameters.
bool bd_technique_shares(const struct bd_technique *technique, const struct bd_params *params,
                         bool glossy_receivers);

// `inputs` are this sub-frame's, without blocks. Brackets its passes itself: "share", those of
// the technique's that light single pixels, and those for glossy receivers.
BD_MUST_CHECK
enum bd_err bd_sub_frame_light(const struct bd_pass_context *context,
                               const struct bd_technique *technique,
                               const struct bd_technique_inputs *inputs,
                               const struct bd_first_sub_frame *first, struct bd_indirect **out,
                               struct bd_err_detail *detail);

#endif
