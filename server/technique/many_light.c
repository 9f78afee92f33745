// Technique `many_light` (ours): light of all kinds, reflected any number of times, with exact
// visibility. Where light first falls, virtual lights of one softness stand for it, of which each
// pixel asks a few by rays; rays of the diffuse lobe that end in a cache of irradiance bring what
// was reflected further, and what that softness leaves out; rays of specular lobes bring all of
// theirs, and what glass shows; a filter smooths each as far as its noise goes; photons bring what
// lamps send through glass. The arithmetic is the processor's, whatever the device, but for rays
// (pass/visibility.h) and the gather.
//
// Papers: Keller 1997 (instant radiosity); Kollig and Keller 2004 (what a bounded kernel leaves
//         out); Jensen 1996 (final gather, photons)
// Exact when: `vpls`, `rays`, `far_rays`, `walk_vpls`, `cache_cells` and `photons` grow, and
//         surfaces send light on as diffuse ones do
// Known:  surfaces send on as much as their whole BRDF reflects, but evenly, but for what comes to
//         plastic straight from lamps, which its coat sends by its lobe, and metals up to roughness
//         .6, which light goes on from as from mirrors; normal maps bend none of it; caustics that
//         are reflected once more go through thin walls, and noise is smoothed across walls that
//         are seen edge on; light that comes through what few photons find (a slit) is late, and
//         own_estimate says half of it; rough surfaces that a later sub-frame lights by itself
//         reflect as in even light; the cheapest rung flickers while lights move

#include "pass/filter_light.h"
#include "pass/gather_chosen.h"
#include "pass/light_paths.h"
#include "technique/far_light.h"
#include "technique/technique.h"

static enum bd_err complete(const struct bd_pass_context *context,
                            const struct bd_technique_inputs *inputs,
                            const struct bd_gather_inputs *gather, struct bd_indirect *indirect,
                            struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    struct bd_far_inputs far =
        bd_far_of_list(inputs, &visibility, inputs->light_paths->first, inputs->params->far_rays);
    enum bd_err err =
        bd_far_light_cache(context, inputs, gather, &indirect->cells, &indirect->rays, detail);
    far.cells = indirect->cells;
    if (!err) err = bd_far_run(context, &far, gather, indirect, detail);
    if (!err) err = bd_far_light_lobes(context, inputs, &far, gather, indirect, detail);
    const struct bd_smoothing smoothing = {BD_FAR_FILTER_LEVELS, inputs->variance_part, false};
    if (!err && inputs->filtered)
        err = bd_filter_light_run(context, gather, &smoothing, indirect, detail);
    return err ? err : bd_far_light_caustics(context, inputs, gather, indirect, detail);
}

// No virtual light lights a lobe.
static struct bd_gather_inputs gather_of(const struct bd_technique_inputs *inputs,
                                         const struct bd_visibility_inputs *visibility)
{
    struct bd_gather_inputs gather = bd_technique_gather_inputs(inputs);
    gather.visibility = visibility;
    gather.glossy = false;
    return gather;
}

static enum bd_err light(const struct bd_pass_context *context,
                         const struct bd_technique_inputs *inputs, struct bd_indirect **out,
                         struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs visibility = bd_technique_vpl_visibility(inputs);
    const struct bd_gather_inputs gather = gather_of(inputs, &visibility);
    const struct bd_gather_chosen_inputs chosen = {&gather, inputs->light_paths->first,
                                                   bd_chosen_rays(inputs->params), inputs->seed};
    enum bd_err err = bd_gather_chosen_run(context, &chosen, out, detail);
    if (err) return err;
    err = complete(context, inputs, &gather, *out, detail);
    if (err) bd_indirect_destroy(context->gpu, out);
    return err;
}

static const struct bd_technique_pass passes[] = {
    {"weigh", BD_WHEN_CHOSEN},
    {"choose", BD_WHEN_ASKED},
    {"visibility", BD_WHEN_ASKED},
    {"gather", 0},
    {"cache", BD_WHEN_FIRST},
    {"far", BD_WHEN_ASKED},
    {"gloss", BD_WHEN_GLOSSY},
    {"rough", BD_WHEN_ROUGH | BD_WHEN_FIRST},
    {"filter", BD_WHEN_FILTERED},
    {"caustics", BD_WHEN_CAUSTICS},
    {NULL, 0},
};
static const struct bd_param_default defaults[] = {
    {BD_PARAM_VPLS, 1024},
    {BD_PARAM_VPL_KERNEL, BD_KERNEL_DISK},
    {BD_PARAM_RAYS, 4},
    {BD_PARAM_INDIRECT_BOUNCES, 64},
};
static const char *const ladder[] = {
    "vpls=512 rays=2 far_rays=2 walk_vpls=512 cache_cells=512 light_rays=16 photons=32768",
    "vpls=1024 rays=4 far_rays=4 walk_vpls=2048 cache_cells=2048 light_rays=16 photons=131072",
    "vpls=2048 rays=8 far_rays=8 walk_vpls=4096 cache_cells=4096 light_rays=16 photons=262144",
    "vpls=4096 rays=16 far_rays=16 walk_vpls=4096 cache_cells=4096 light_rays=32 photons=524288",
    "vpls=8192 rays=32 far_rays=32 walk_vpls=8192 cache_cells=8192 light_rays=32 photons=1048576",
    "vpls=16384 rays=64 far_rays=64 walk_vpls=16384 cache_cells=32768 light_rays=64 "
    "photons=1048576",
    "vpls=32768 rays=128 far_rays=128 walk_vpls=32768 cache_cells=65536 light_rays=64 "
    "photons=1048576",
    "vpls=65536 rays=256 far_rays=256 walk_vpls=65536 cache_cells=131072 light_rays=128 "
    "photons=1048576",
    NULL,
};

const struct bd_technique bd_technique_many_light = {
    .name = "many_light",
    .summary = "all light, any number of reflections: virtual lights, and rays that end in a cache",
    .model = {.indirect_bounces = BD_MODEL_BOUNCES_UNLIMITED,
              .indirect_visibility = true,
              .lights = BD_LIGHTS_ALL,
              .glossy_receivers = true,
              .transmission = true,
              .coverage = true,
              .indirect_lights = BD_LIGHTS_ALL},
    .inputs = BD_INPUT_FINAL_GATHER,
    .passes = passes,
    .params_read = BD_READS_DIRECT | BD_READS(BD_PARAM_VPLS) | BD_READS_VISIBILITY |
                   BD_READS_LIGHT_PATHS | BD_READS(BD_PARAM_WALK_VPLS) |
                   BD_READS(BD_PARAM_CACHE_CELLS) | BD_READS(BD_PARAM_FAR_RAYS) |
                   BD_READS(BD_PARAM_SUB_FRAMES) | BD_READS(BD_PARAM_LIGHT_BLOCKS) |
                   BD_READS_CAUSTICS,
    .defaults = defaults,
    .default_count = sizeof defaults / sizeof *defaults,
    .tolerance = {.direct = 1e-3, .indirect = 3e-2}, // of sums: noise of its virtual lights
    .hazard_codes = "",
    .ladder = ladder,
    .view_rungs = 2, // one takes 1.1 to 1.7 times as long as that before it, with 16 sub-frames
    .is_sampled = true,
    .indirect = light,
    .light_pixels = bd_far_light_pixels,
    .light_glossy = bd_far_light_anew,
};
