// Technique `multires_gather` (algorithms.md A2.1, A2.2): one diffuse bounce from a grid of VPLs,
// gathered at one point of each block of pixels in which nothing jumps, and interpolated between.
//
// Paper:  Nichols, Shopf and Wyman 2009, 3.2 (gathering at fragments); Nichols and Wyman 2010, 3.2
//         and 3.5 (discontinuities, upsampling)
// Exact when: as `rsm` is, and `coarsest` reaches the picture's longer side: then every pixel is a
//         fragment. Thresholds of 0 leave blocks only where depth and normals are the same
// Known:  ignores occlusion of VPLs unless told otherwise; light that changes quickly over a smooth
//         surface is blurred over blocks. Glossy pixels pay for every VPL. Rough normal maps come
//         out darker: the irradiance vector counts VPLs below a pixel's own horizon as negative,
//         where `rsm` counts none

#include "technique/fragment_light.h"
#include "technique/glossy_light.h"
#include "technique/technique.h"
#include "technique/visible_light.h"

static enum bd_err gather_glossy(const struct bd_pass_context *context,
                                 const struct bd_technique_inputs *inputs,
                                 struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    // A device without rays is given a list of the pixels that have lobes.
    if (inputs->occluders || context->processor)
        return bd_visible_lobes(context, inputs, indirect, detail);
    return bd_glossy_light(context, inputs, BD_GLOSSY_LIGHT_AT_PIXELS, indirect, detail);
}

static enum bd_err gather_fragments(const struct bd_pass_context *context,
                                    const struct bd_technique_inputs *inputs,
                                    struct bd_indirect **out, struct bd_err_detail *detail)
{
    enum bd_err err =
        bd_fragment_light(context, inputs, "gather", bd_fragments_gather, out, detail);
    if (err || !inputs->glossy_receivers) return err;
    err = gather_glossy(context, inputs, *out, detail);
    if (err) bd_indirect_destroy(context->gpu, out);
    return err;
}

static const struct bd_technique_pass passes[] = {
    BD_FRAGMENT_PASSES, {"glossy", BD_WHEN_GLOSSY}, {NULL, 0}};
// Flat walls stay few blocks whatever the thresholds are: towards the top it is how large a block
// may be that makes them more.
static const char *const ladder[] = {
    "vpls=64 depth_threshold=0.05 normal_threshold=0.9 finest=4 light_threshold=0.2 coarsest=64",
    "vpls=256 depth_threshold=0.02 normal_threshold=0.5 finest=4 light_threshold=0.1 coarsest=64",
    "vpls=1024 depth_threshold=0.01 normal_threshold=0.25 finest=2 light_threshold=0.05 "
    "coarsest=64",
    "vpls=2048 depth_threshold=0.005 normal_threshold=0.1 finest=1 light_threshold=0.02 "
    "coarsest=64",
    "vpls=8192 depth_threshold=0.005 normal_threshold=0.1 finest=1 light_threshold=0.02 "
    "coarsest=64",
    "vpls=16384 depth_threshold=0.002 normal_threshold=0.05 finest=1 light_threshold=0.01 "
    "coarsest=64",
    "vpls=65536 depth_threshold=0.002 normal_threshold=0.05 finest=1 light_threshold=0.01 "
    "coarsest=64",
    "vpls=65536 depth_threshold=0.002 normal_threshold=0.05 finest=1 light_threshold=0.01 "
    "coarsest=128",
    "vpls=65536 depth_threshold=0.002 normal_threshold=0.05 finest=1 light_threshold=0.01 "
    "coarsest=256",
    "vpls=65536 depth_threshold=0 normal_threshold=0 finest=1 light_threshold=0.005 coarsest=512",
    NULL,
};

// Found on seven scenes (tests/bench/results/NOTES.md): nowhere is the error above that of the
// papers' tests, in most it is half of it or less, for a quarter fewer fragments where there are
// many.
static const struct bd_param_default defaults[] = {
    {BD_PARAM_DEPTH_TEST, BD_DEPTH_TEST_STEP},
    {BD_PARAM_DEPTH_THRESHOLD, 0.01},
    {BD_PARAM_FINEST, 1}, // 2 pixels
    {BD_PARAM_LIGHT_THRESHOLD, 0.05},
    BD_DEFAULT_VISIBILITY,
};

const struct bd_technique bd_technique_multires_gather = {
    .name = "multires_gather",
    .summary = "one bounce from a grid of virtual lights, gathered once for each smooth block",
    .model = {.indirect_bounces = 1,
              .lights = BD_LIGHTS_ALL,
              .indirect_lights = BD_LIGHTS_ALL,
              .glossy_receivers = true,
              .transmission = true,
              .coverage = true},
    .inputs = BD_INPUT_VPL_GRID | BD_INPUT_FRAGMENTS,
    .passes = passes,
    .params_read = BD_READS_VPL_GRID | BD_READS_LIGHT_PATHS | BD_READS_VISIBILITY |
                   BD_READS_FRAGMENTS | BD_READS(BD_PARAM_LIGHT_THRESHOLD) |
                   BD_READS(BD_PARAM_VISIT) | BD_READS(BD_PARAM_SUB_FRAMES),
    .tolerance = {.direct = 1e-3, .indirect = 1e-2},
    .hazard_codes = "TN",
    .defaults = defaults,
    .default_count = sizeof defaults / sizeof *defaults,
    .ladder = ladder,
    .indirect = gather_fragments,
    .light_pixels = bd_fragments_gather,
    .light_glossy = gather_glossy,
};
