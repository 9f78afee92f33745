// Indirect light of a frame's first sub-frame, taken over by another sub-frame: light on smooth
// surfaces changes little within a pixel, and G-buffer and direct light, which do, are each
// sub-frame's own. Or light of blocks of pixels, which a first one of fewer pixels has.
//
// A pixel's irradiance is interpolated between the first sub-frame's pixels around it that see the
// same surface (shaders/common/one_surface.glsl). Where most of them do not, at edges, behind what
// the first sub-frame saw, in foliage, on thin rods, or where light differs much among them, it is
// a fragment of its own and has to be lit.
//
// Exact where irradiance is linear over a pixel. Its error is what a pixel's neighbours do not tell
// of it: tests/analytic/sub_frames.c holds it.

#ifndef BD_PASS_SHARED_LIGHT_H
#define BD_PASS_SHARED_LIGHT_H

#include "pass/fragments.h"
#include "pass/gather.h"

struct bd_shared_light_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint; // of this sub-frame
    const struct bd_gbuffer *gbuffer;
    const struct bd_viewpoint *first_viewpoint; // the same but for where rays pass a pixel
    struct bd_pixel_blocks blocks;              // that are its pixels
    const struct bd_gbuffer *first_gbuffer;
    // Its `gathered`, `vector`, `rough` and noise count if they are there.
    const struct bd_indirect *first;
};

struct bd_shared_light {
    struct bd_indirect *indirect; // irradiance, what rough lobes reflect (a = 0: `missing`), noise
    struct bd_discontinuity *pixels; // what `missing` is a list of: pixels alone
    struct bd_fragments *missing;
};

BD_MUST_CHECK
enum bd_err bd_shared_light_run(const struct bd_pass_context *context,
                                const struct bd_shared_light_inputs *inputs,
                                struct bd_shared_light *out, struct bd_err_detail *detail);
// All that is still there.
void bd_shared_light_finish(struct bd_gpu *gpu, struct bd_shared_light *light);

#endif
