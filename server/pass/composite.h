// Composite: one layer of the picture from G-buffer, direct and indirect light; sub-frames of an
// antialiased frame are averaged here, in linear light, layer by layer.

#ifndef BD_PASS_COMPOSITE_H
#define BD_PASS_COMPOSITE_H

#include <stdbool.h>

#include "pass/gather.h"
#include "pass/gbuffer.h"
#include "pass/pass.h"
#include "shared/composite.h"

struct bd_composite_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_gbuffer *gbuffer;
    const struct bd_tex *direct;
    const struct bd_indirect *indirect; // NULL: the technique has none
    bool lambert;
    uint32_t sub_frame, sub_frame_count;
};

// Adds this sub-frame to `layer` (RGBA32F, the frame's size; every texel is written), where
// `which` is BD_COMPOSITE_*. Radiance is in cd/m^2, depth in metres.
BD_MUST_CHECK
enum bd_err bd_composite_run(const struct bd_pass_context *context,
                             const struct bd_composite_inputs *inputs, uint32_t which,
                             struct bd_tex *layer, struct bd_fault *fault);

#endif
