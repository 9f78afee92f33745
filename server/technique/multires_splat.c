// Technique `multires_splat` (algorithms.md A1): the fragments of `multires_gather`, to which each
// VPL is splatted as to so many points, instead of each fragment gathering from all VPLs.
//
// Paper:  Nichols and Wyman 2010
// Exact when: as `multires_gather`, whose picture it makes to rounding
// Known:  what is known of `multires_gather`; a fragment's surface is read again for every VPL:
//         that is why the later paper gathers

#include "pass/splat_fragments.h"
#include "technique/fragment_light.h"
#include "technique/technique.h"

static enum bd_err splat_fragments(const struct bd_pass_context *context,
                                   const struct bd_technique_inputs *inputs,
                                   struct bd_indirect **out, struct bd_fault *fault)
{
    return bd_fragment_light(context, inputs, "splat", bd_splat_fragments_run, out, fault);
}

static const char *const passes[] = {"splat", "upsample", NULL};
static const char *const ladder[] = {
    "vpls=16 depth_threshold=0.2 normal_threshold=1",
    "vpls=64 depth_threshold=0.2 normal_threshold=1",
    "vpls=256 depth_threshold=0.1 normal_threshold=0.5",
    "vpls=512 depth_threshold=0.05 normal_threshold=0.25",
    "vpls=1024 depth_threshold=0 normal_threshold=0",
    NULL,
};

const struct bd_technique bd_technique_multires_splat = {
    .name = "multires_splat",
    .summary = "one bounce from a grid of virtual lights, splatted to smooth blocks of pixels",
    .model = {.indirect_bounces = 1, .lights = BD_LIGHTS_PUNCTUAL},
    .inputs = BD_INPUT_VPL_GRID | BD_INPUT_FRAGMENTS,
    .passes = passes,
    .params_read = BD_READS_VPL_GRID | BD_READS_FRAGMENTS,
    // With as many as `multires_gather` has, to which it is held, the tests would take minutes.
    .tolerance = {.direct = 1e-3, .indirect = 3e-2, .settings = "vpls=256"},
    .hazard_codes = "TN",
    .ladder = ladder,
    .indirect = splat_fragments,
};
