// Masked coarse-to-fine interpolation of light at fragments to every pixel (algorithms.md A1,
// Upsampling): from the coarsest level on, each block that lies in a fragment of its own level or
// above takes the mean, weighted by a tent over 3 x 3, of those around it that hold data. Whether a
// block holds data is a mask of its own: black is data.

#ifndef BD_PASS_UPSAMPLE_H
#define BD_PASS_UPSAMPLE_H

#include "pass/gather_fragments.h"

enum bd_surface_detail {
    BD_SURFACE_DETAIL_OFF,
    BD_SURFACE_DETAIL_DIRECTION, // E x <n, e> / <n_fragment, e>, e the dominant direction, in [0,
                                 // 4]
    BD_SURFACE_DETAIL_PAPER,     // Eq. 3 with alpha = .5: darkens
};

struct bd_upsample_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_gbuffer *gbuffer;
    const struct bd_discontinuity *discontinuity;
    struct bd_multires_light *light; // its textures are written over
    enum bd_surface_detail detail;
};

// `out`->irradiance covers every pixel that can be lit; `glossy` is NULL.
BD_MUST_CHECK
enum bd_err bd_upsample_run(const struct bd_pass_context *context,
                            const struct bd_upsample_inputs *inputs, struct bd_indirect **out,
                            struct bd_fault *fault);

#endif
