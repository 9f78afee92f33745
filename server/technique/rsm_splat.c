// Baseline `rsm_splat` (algorithms.md A0.7 N3): the virtual lights of `rsm`, each splatted to the
// pixels that it can light brightest, and to no others.
//
// Paper:  Dachsbacher and Stamminger 2006 (splatting indirect illumination); the bound is set as in
//         Nichols, Shopf and Wyman 2009, Fig. 8: by how many fragments all splats make together
// Exact when: as `rsm`, and splat_share = 1
// Known:  what lies beyond the bounds is lost: at the share that a multiresolution picture needs,
//         most of the light. The bound depends on all lights together: below splat_share = 1 light
//         of two punctual lights is not the sum of that of each. What `rsm` ignores is ignored here

#include "pass/splat_vpls.h"
#include "technique/technique.h"

static enum bd_err splat_indirect(const struct bd_pass_context *context,
                                  const struct bd_technique_inputs *inputs,
                                  struct bd_indirect **out, struct bd_err_detail *detail)
{
    const struct bd_gather_inputs splat = bd_technique_gather_inputs(inputs);
    struct bd_splat_bound bound;
    bd_gpu_pass_begin(context->gpu, "splat");
    enum bd_err err =
        bd_splat_bound_find(context, &splat, inputs->params->splat_share, &bound, detail);
    if (!err) err = bd_splat_vpls_run(context, &splat, &bound, out, detail);
    bd_gpu_pass_end(context->gpu);
    return err;
}

static const struct bd_technique_pass passes[] = {{"splat", 0}, {NULL, 0}};
// A share below 1 never pays: for the same fragments fewer VPLs with all their light are nearer.
static const char *const ladder[] = {"vpls=16 splat_share=1",
                                     "vpls=64 splat_share=1",
                                     "vpls=256 splat_share=1",
                                     "vpls=1024 splat_share=1",
                                     "vpls=4096 splat_share=1",
                                     "vpls=16384 splat_share=1",
                                     NULL};

// Without bounds, and as many as make a picture in about a second. The papers' share is a part of
// the picture's light; whoever compares with it names it.
static const struct bd_param_default defaults[] = {
    {BD_PARAM_VPLS, 256},
    {BD_PARAM_SPLAT_SHARE, 1},
};

const struct bd_technique bd_technique_rsm_splat = {
    .name = "rsm_splat",
    .summary = "one bounce from a grid of virtual lights, splatted where each is brightest",
    .model = {.indirect_bounces = 1,
              .lights = BD_LIGHTS_ALL,
              .indirect_lights = BD_LIGHTS_PUNCTUAL,
              .glossy_receivers = true},
    .inputs = BD_INPUT_VPL_GRID,
    .passes = passes,
    .params_read = BD_READS_VPL_GRID | BD_READS(BD_PARAM_SPLAT_SHARE),
    .tolerance = {.direct = 1e-3, .indirect = 1e-2, .settings = "vpls=1024"},
    .hazard_codes = "T",
    .defaults = defaults,
    .default_count = sizeof defaults / sizeof *defaults,
    .ladder = ladder,
    .for_comparison = true,
    .indirect = splat_indirect,
};
