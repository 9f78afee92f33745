// Composite: layers of the picture from G-buffer, direct and indirect light; sub-frames of an
// antialiased frame are averaged here, in linear light, layer by layer. Their plain sum is kept
// until the end, so that a frame of so many sub-frames is the beginning of one of more.

#ifndef BD_PASS_COMPOSITE_H
#define BD_PASS_COMPOSITE_H

#include <stdbool.h>

#include "pass/area_direct.h"
#include "pass/gather.h"
#include "pass/gbuffer.h"
#include "pass/pass.h"
#include "shared/composite.h"

struct bd_composite_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_gbuffer *gbuffer;
    const struct bd_tex *direct;             // NULL: no punctual light shines
    const struct bd_area_direct *area_light; // NULL: nothing with a size shines
    const struct bd_indirect *indirect;      // NULL: the technique has none
    const struct bd_indirect *glass;         // NULL: what it shows is in `indirect`, or nothing
    bool filtered;                           // indirect light: its noise is what doubt is left
    bool whole; // receivers without a lobe worth rays reflect it by their whole BRDF, in the mean
    bool lambert;
    bool halves_exchanged; // noise counts the other way round
    bool first; // nothing was added before
    bool only;  // nothing will be: the layer is finished
};

// Adds this sub-frame to layers, by BD_COMPOSITE_* (RGBA32F, the frame's size; every texel is
// written; NULL: not asked for). Radiance is in cd/m^2, depth in metres.
BD_MUST_CHECK
enum bd_err bd_composite_run(const struct bd_pass_context *context,
                             const struct bd_composite_inputs *inputs,
                             struct bd_tex *const layers[BD_COMPOSITE_LAYERS],
                             struct bd_err_detail *detail);

struct bd_composite_sums {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    struct bd_tex *sums; // of `count` sub-frames; kept as they are
    uint32_t count;
};

// The layer `which` from the sums of its sub-frames. Every texel of `layer` is written.
BD_MUST_CHECK
enum bd_err bd_composite_finish(const struct bd_pass_context *context,
                                const struct bd_composite_sums *inputs, uint32_t which,
                                struct bd_tex *layer, struct bd_err_detail *detail);

#endif
