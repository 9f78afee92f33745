// Technique `multires_splat` (algorithms.md A1): the fragments of `multires_gather`, to which each
// VPL is splatted as to so many points, instead of each fragment gathering from all VPLs.
//
// Glossy receivers have, for each VPL, a list of blocks of their own, refined where the lobe
// changes.
//
// Paper:  Nichols and Wyman 2010
// Exact when: as `multires_gather`, whose picture it makes of what is diffuse, to rounding, at the
//         same blocks and with light_threshold=inf (its own defaults are the papers' blocks, those
//         of `multires_gather` are not); of what is glossy as `rsm`, with radiance_threshold=0
// Known:  ignores occlusion of VPLs; a lobe that is narrow before the quarters of a block is
//         missed, as is light that changes quickly over a smooth surface; a fragment's surface is
//         read again for every VPL: that is why the later paper gathers

#include "technique/fragment_light.h"
#include "technique/glossy_light.h"
#include "technique/technique.h"

static enum bd_err splat_fragments(const struct bd_pass_context *context,
                                   const struct bd_technique_inputs *inputs,
                                   struct bd_indirect **out, struct bd_err_detail *detail)
{
    enum bd_err err = bd_fragment_light(context, inputs, "splat", bd_fragments_splat, out, detail);
    if (err || !inputs->glossy_receivers) return err;
    err = bd_glossy_light(context, inputs, BD_GLOSSY_LIGHT_AT_BLOCKS, *out, detail);
    if (err) bd_indirect_destroy(context->gpu, out);
    return err;
}

static const struct bd_technique_pass passes[] = {
    {"splat", 0}, {"upsample", 0}, {"subsplats", BD_WHEN_GLOSSY}, {NULL, 0}};
static const char *const ladder[] = {
    "vpls=16 depth_threshold=0.2 normal_threshold=1 radiance_threshold=0.5",
    "vpls=64 depth_threshold=0.2 normal_threshold=1 radiance_threshold=0.5",
    "vpls=256 depth_threshold=0.1 normal_threshold=0.5 radiance_threshold=0.5",
    "vpls=512 depth_threshold=0.05 normal_threshold=0.25 radiance_threshold=0.25",
    "vpls=1024 depth_threshold=0.05 normal_threshold=0.25 radiance_threshold=0.25",
    "vpls=1024 depth_threshold=0.01 normal_threshold=0.05 radiance_threshold=0.1",
    "vpls=1024 depth_threshold=0 normal_threshold=0 radiance_threshold=0",
    NULL,
};

const struct bd_technique bd_technique_multires_splat = {
    .name = "multires_splat",
    .summary = "one bounce from a grid of virtual lights, splatted to smooth blocks of pixels",
    .model = {.indirect_bounces = 1,
              .lights = BD_LIGHTS_ALL,
              .indirect_lights = BD_LIGHTS_PUNCTUAL,
              .glossy_receivers = true},
    .inputs = BD_INPUT_VPL_GRID | BD_INPUT_FRAGMENTS,
    .passes = passes,
    .params_read = BD_READS_VPL_GRID | BD_READS_FRAGMENTS | BD_READS_SUBSPLATS,
    // With as many as `multires_gather` has, to which it is held, the tests would take minutes.
    .tolerance = {.direct = 1e-3, .indirect = 3e-2, .settings = "vpls=256"},
    .hazard_codes = "TN",
    .ladder = ladder,
    .for_comparison = true,
    .indirect = splat_fragments,
};
