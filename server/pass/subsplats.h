// Multiresolution splatting for BRDFs that are not diffuse (Nichols and Wyman 2010, per-VPL
// refinement driven by illumination; algorithms.md A1): for each VPL a list of blocks of its own,
// as coarse as what its specular lobe does over them allows.
//
// What is looked at is what one VPL's light, reflected by the whole BRDF beyond base colour / pi,
// sends to the viewer from four points of a block. Where that varies by more than a threshold, the
// block gives way to its children in that VPL's list, down to the pixel. Elsewhere the plane
// through the four is added to a multiresolution image. So each pixel gets each VPL's light exactly
// once, and with a threshold of 0 what bd_gather_run gives it, to rounding.
//
// The lists of a batch of VPLs are kept together, as one list of blocks with a bit for each VPL
// (shared/subsplats.h), made by prefix sums: sums have the same order on every run and device.
//
// Pixels that are in every list from the start are gathered at.
//
// Deviations: the paper adds a constant for each block and blends blocks with their neighbours on
// the way to the pixels; where a VPL's blocks change level, light of one block is then mixed with
// none: a quarter of it is lost on one side and given twice on the other. A plane needs no
// neighbour, and its four points have been paid for.

#ifndef BD_PASS_SUBSPLATS_H
#define BD_PASS_SUBSPLATS_H

#include "pass/fragments.h"
#include "pass/gather.h"

enum bd_radiance_test {
    BD_RADIANCE_TEST_RELATIVE, // to the VPL's largest there + what a white diffuse surface would
                               // reflect there of the mean VPL's light
    BD_RADIANCE_TEST_ABSOLUTE, // in cd/m^2
};

struct bd_subsplats_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_gbuffer *gbuffer;
    const struct bd_fragments *start;       // every VPL's first list (pass/glossy_blocks.h)
    const struct bd_tex *irradiance;        // of all VPLs, at every pixel
    const struct bd_vpl_list *const *lists; // one a light, in the order that they are summed in
    uint32_t list_count;
    bool near_patches; // some VPL asks for the exact near field
    enum bd_radiance_test test;
    double threshold;     // 0: every block is split down to its pixels
    uint32_t block_limit; // blocks that a list holds, at most: what would not fit is not split
};

// Sums `counts` over all VPLs; see struct bd_indirect. `glossy` as there.
BD_MUST_CHECK
enum bd_err bd_subsplats_run(const struct bd_pass_context *context,
                             const struct bd_subsplats_inputs *inputs, struct bd_tex **glossy,
                             struct bd_subsplat_counts *counts, struct bd_err_detail *detail);

#endif
