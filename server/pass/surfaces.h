// Which blocks of a picture are of one surface with those around them, so that light of one may be
// interpolated with that of the other. It depends on what the camera sees, and not on light.
//
// Levels are gone through from the coarsest down. What lies under a block in which nothing jumps,
// among eight such blocks of its surface, is not looked at (shaders/pass/surfaces/look.comp).

#ifndef BD_PASS_SURFACES_H
#define BD_PASS_SURFACES_H

#include "pass/discontinuity.h"

struct bd_surfaces {
    // R32UI (shared/surfaces.h), levels from 1 on, stacked (shared/multires.h).
    struct bd_tex *words;
    // uint32 BD_PIXEL_PACK of the blocks that hold light and lie next to whatever is not of their
    // surface, and two uint32 of the children of each (shared/surfaces.h). In a level in no order.
    struct bd_buf *outer, *children;
    uint32_t outer_first[BD_MULTIRES_LEVEL_MAX], children_first[BD_MULTIRES_LEVEL_MAX];
    uint32_t outer_count[BD_MULTIRES_LEVEL_MAX];
};

// `inputs` are those of the camera's `discontinuity`.
BD_MUST_CHECK
enum bd_err bd_surfaces_run(const struct bd_pass_context *context,
                            const struct bd_discontinuity_inputs *inputs,
                            const struct bd_discontinuity *discontinuity, struct bd_surfaces **out,
                            struct bd_err_detail *detail);
void bd_surfaces_destroy(struct bd_gpu *gpu, struct bd_surfaces **surfaces);
uint64_t bd_surfaces_bytes(const struct bd_surfaces *surfaces);

#endif
