// Masked coarse-to-fine interpolation of light at fragments to every pixel (algorithms.md A1,
// Upsampling): from the coarsest level on, each block that lies in a fragment above its own level
// takes the mean, weighted by a tent over 3 x 3, of those around it that hold data and are the same
// surface. Whether a block holds data is a mask of its own: black is data.
//
// What departs from the paper, each for a smaller error where light changes smoothly: a fragment
// keeps what it gathered at its own level; where some of the 3 x 3 hold no data the weights are
// tilted, so that light which changes linearly over the picture stays linear; and where a block has
// neighbours on both sides, their second difference counts. As printed the filter also blurs what
// was gathered at its own level, and leans to one side wherever something is missing: at every
// silhouette, at every change of level, at the picture's edge.

#ifndef BD_PASS_UPSAMPLE_H
#define BD_PASS_UPSAMPLE_H

#include "pass/gather_fragments.h"
#include "pass/surfaces.h"

// What a pixel's own normal adds to light of a block.
enum bd_surface_detail {
    BD_SURFACE_DETAIL_OFF,
    // E times (V . n) / the sum of E's channels, which is held to [0, 4]: V the irradiance vector
    // of that sum, n the pixel's normal
    BD_SURFACE_DETAIL_DIRECTION,
    BD_SURFACE_DETAIL_PAPER, // Eq. 3 with alpha = .5: darkens
};

struct bd_upsample_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_gbuffer *gbuffer;
    const struct bd_fragments *fragments;
    struct bd_fragments *const *parts; // lists that bd_fragments_refine made of them
    uint32_t part_count;
    const struct bd_surfaces *surfaces;
    struct bd_multires_light *light; // its coarse textures are written over; with vectors for
                                     // BD_SURFACE_DETAIL_DIRECTION
    enum bd_surface_detail detail;
    bool keep_vector; // with BD_SURFACE_DETAIL_DIRECTION: for pass/shared_light
};

// `out`->irradiance covers every pixel that can be lit, as do `gathered` and `vector` if they are
// to be kept; `glossy` is NULL.
BD_MUST_CHECK
enum bd_err bd_upsample_run(const struct bd_pass_context *context,
                            const struct bd_upsample_inputs *inputs, struct bd_indirect **out,
                            struct bd_err_detail *detail);

#endif
