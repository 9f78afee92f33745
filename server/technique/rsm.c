// Baseline `rsm` (algorithms.md A0.7 N1): one diffuse bounce from a regular grid of VPLs over each
// light's reflective shadow map, gathered at every pixel, without visibility of the VPLs.
//
// Paper:  Dachsbacher and Stamminger 2005 (reflective shadow maps); kernel of Nichols, Shopf and
//         Wyman 2009, Eq. 1, with the near-field rule of A2.2
// Exact when: `vpls` grows, nothing stands between VPL and receiver, surfaces that send light on
//         are diffuse
// Known:  ignores occlusion of VPLs; metals send no light on (their lobe is not diffuse)

#include "pass/gather_chosen.h"
#include "technique/fragment_light.h"
#include "technique/technique.h"

static enum bd_err gather_indirect(const struct bd_pass_context *context,
                                   const struct bd_technique_inputs *inputs,
                                   struct bd_indirect **out, struct bd_fault *fault)
{
    struct bd_gather_inputs gather = bd_technique_gather_inputs(inputs);
    const struct bd_visibility_inputs visibility = {
        inputs->rays, inputs->pool, (enum bd_rays_alpha)inputs->params->alpha_coverage};
    if (inputs->rays) gather.visibility = &visibility;
    const struct bd_gather_chosen_inputs chosen = {&gather, inputs->params->rays, inputs->seed};
    return inputs->chosen ? bd_gather_chosen_run(context, &chosen, out, fault)
                          : bd_gather_run(context, &gather, out, fault);
}

static const struct bd_technique_pass passes[] = {
    {"weigh", BD_WHEN_CHOSEN}, {"choose", BD_WHEN_RAYS}, {"visibility", BD_WHEN_RAYS}, {"gather", 0}, {NULL, 0}};
static const struct bd_param_default defaults[] = {
    {BD_PARAM_INDIRECT_VISIBILITY, BD_VISIBILITY_NONE},
    {BD_PARAM_ALPHA, BD_RAYS_ALPHA_MASK},
};
static const char *const ladder[] = {"vpls=16",   "vpls=64",    "vpls=256",   "vpls=1024",
                                     "vpls=4096", "vpls=16384", "vpls=65536", NULL};

const struct bd_technique bd_technique_rsm = {
    .name = "rsm",
    .summary = "one bounce from a grid of virtual lights, gathered at every pixel",
    .model = {.indirect_bounces = 1, .lights = BD_LIGHTS_PUNCTUAL, .glossy_receivers = true},
    .inputs = BD_INPUT_VPL_GRID,
    .passes = passes,
    .params_read = BD_READS_VPL_GRID | BD_READS_VISIBILITY | BD_READS(BD_PARAM_SUB_FRAMES),
    .defaults = defaults,
    .default_count = sizeof defaults / sizeof *defaults,
    .tolerance = {.direct = 1e-3, .indirect = 1e-2},
    .hazard_codes = "",
    .ladder = ladder,
    .indirect = gather_indirect,
    .light_pixels = bd_fragments_gather,
};
