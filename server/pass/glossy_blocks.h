// Which blocks of the picture hold glossy receivers: those of a discontinuity pyramid, held to the
// pixels whose specular lobe counts, and split where that lobe would change with the surface: where
// materials differ, or shading normals do (the pyramid may look at geometric ones alone).
//
// A block that holds other pixels too is discontinuous: all pixels of a smooth one are glossy.

#ifndef BD_PASS_GLOSSY_BLOCKS_H
#define BD_PASS_GLOSSY_BLOCKS_H

#include "pass/discontinuity.h"

struct bd_glossy_blocks_inputs {
    const struct bd_gbuffer *gbuffer;
    const struct bd_viewpoint *viewpoint;
    const struct bd_render_space *space;
    const struct bd_discontinuity *discontinuity;
    double normal_threshold;   // range of a component; infinite: not tested
    double material_threshold; // range of a channel of the base colour, of roughness, metallic, F0
};

// For pass/fragments; destroyed as a discontinuity is.
BD_MUST_CHECK
enum bd_err bd_glossy_blocks_run(const struct bd_pass_context *context,
                                 const struct bd_glossy_blocks_inputs *inputs,
                                 struct bd_discontinuity **out, struct bd_err_detail *detail);
// No blocks at all: its fragments are the glossy pixels.
BD_MUST_CHECK
enum bd_err bd_glossy_pixels(struct bd_gpu *gpu, const struct bd_viewpoint *viewpoint,
                             struct bd_discontinuity **out, struct bd_err_detail *detail);

#endif
