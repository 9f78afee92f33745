// Technique `ssbc`: screen-space bias compensation (Novak, Engelhardt, Dachsbacher 2011). Virtual
// lights stand for all reflected light, of any number of reflections; their kernel is clamped, so
// that none shows as a bright dot, and what the clamp takes off near surfaces is given back from
// the picture itself, in a few iterations over its pixels.
//
// The paper's clamped light by itself is residual=screen and iterations=0.
//
// Exact when: `vpls`, `walk_vpls`, `rays`, `iterations` and the picture's size grow, what is within
//         1 / sqrt(clamp) of a surface is in the picture, and surfaces send light on evenly
// Known:  with residual=screen what the picture gives back goes through what stands between, what
//         it does not show of a surface's neighbourhood gives nothing back, mirrors are blurred,
//         and sub-frames share none; with indirect_bounces from 2 on the picture sends light on
//         once more
// Price:  that of `rays` and `far_rays` a pixel, and some 100 parts of the picture a pixel and
//         iteration

#include <math.h>

#include "pass/area_direct.h"
#include "pass/direct.h"
#include "pass/filter_light.h"
#include "pass/gather_chosen.h"
#include "pass/light_paths.h"
#include "pass/residual.h"
#include "technique/far_light.h"
#include "technique/technique.h"

// What the clamp took off, where the picture shows all that is near.
static enum bd_err give_back(const struct bd_pass_context *context,
                             const struct bd_technique_inputs *inputs, struct bd_screen *screen,
                             struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    const struct bd_params *params = inputs->params;
    const struct bd_residual_inputs residual = {
        .screen = screen,
        .pool = inputs->pool,
        .direct = inputs->made.direct ? inputs->made.direct->irradiance : NULL,
        .area_light = inputs->made.area_light ? inputs->made.area_light->irradiance : NULL,
        .clamp = inputs->light_paths->clamped->clamp,
        .iterations = params->iterations,
        .once = params->indirect_bounces == 1,
        .smooth_sr = (float)params->residual_threshold,
        .edge_sr = (float)params->residual_edge_threshold,
    };
    return bd_residual_run(context, &residual, indirect, detail);
}

// Elsewhere; without a screen everywhere. Lobes have rays of their own.
static enum bd_err bring_back(const struct bd_pass_context *context,
                              const struct bd_technique_inputs *inputs,
                              const struct bd_gather_inputs *gather, const struct bd_screen *screen,
                              struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    struct bd_far_inputs far =
        bd_far_of_list(inputs, &visibility, inputs->light_paths->clamped, inputs->params->far_rays);
    enum bd_err err =
        bd_far_light_cache(context, inputs, gather, &indirect->cells, &indirect->rays, detail);
    far.cells = indirect->cells;
    far.screen = screen;
    if (!err) err = bd_far_run(context, &far, gather, indirect, detail);
    if (!err) err = bd_far_light_lobes(context, inputs, &far, gather, indirect, detail);
    return err;
}

// Rays first: what they bring is sent on by the picture, too. The filter sees both, or it would
// blur where one ends and the other begins.
static enum bd_err complete(const struct bd_pass_context *context,
                            const struct bd_technique_inputs *inputs,
                            const struct bd_gather_chosen_inputs *chosen, struct bd_screen *screen,
                            struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    const bool rays = bd_params_bring_back(inputs->params);
    const struct bd_smoothing smoothing = {rays ? BD_FAR_FILTER_LEVELS
                                                : bd_filter_levels_of_chosen(chosen->rays),
                                           inputs->variance_part, false};
    enum bd_err err = BD_ERR_OK;
    if (rays) err = bring_back(context, inputs, chosen->gather, screen, indirect, detail);
    if (!err && screen) err = give_back(context, inputs, screen, indirect, detail);
    if (!err && inputs->filtered)
        err = bd_filter_light_run(context, chosen->gather, &smoothing, indirect, detail);
    return err ? err : bd_far_light_caustics(context, inputs, chosen->gather, indirect, detail);
}

static enum bd_err make_screen(const struct bd_pass_context *context,
                               const struct bd_technique_inputs *inputs,
                               const struct bd_gather_inputs *gather, struct bd_screen **out,
                               struct bd_err_detail *detail)
{
    const struct bd_params *params = inputs->params;
    *out = NULL;
    if (!bd_params_give_back(params, inputs->glass)) return BD_ERR_OK;
    const struct bd_screen_inputs screen = {
        .gather = gather,
        .pool = inputs->pool,
        .lambert = params->lambert,
        .mirrors = inputs->glass,
        .glossy = gather->glossy,
        .printed = params->paper_mode,
        .levels = params->residual_levels,
        .reach = bd_params_bring_back(params) ? 1 / sqrtf(inputs->light_paths->clamped->clamp) : 0,
    };
    return bd_screen_create(context, &screen, out, detail);
}

static enum bd_err light(const struct bd_pass_context *context,
                         const struct bd_technique_inputs *inputs, struct bd_indirect **out,
                         struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs visibility = bd_technique_vpl_visibility(inputs);
    struct bd_gather_inputs gather = bd_technique_gather_inputs(inputs);
    const struct bd_gather_chosen_inputs chosen = {&gather, inputs->light_paths->clamped,
                                                   bd_chosen_rays(inputs->params), inputs->seed};
    gather.visibility = &visibility;
    gather.glossy &= !bd_params_bring_back(inputs->params);
    struct bd_screen *screen;
    enum bd_err err = bd_gather_chosen_run(context, &chosen, out, detail);
    if (err) return err;
    err = make_screen(context, inputs, &gather, &screen, detail);
    if (!err) err = complete(context, inputs, &chosen, screen, *out, detail);
    bd_screen_destroy(&screen);
    if (err) bd_indirect_destroy(context->gpu, out);
    return err;
}

static const struct bd_technique_pass passes[] = {
    {"weigh", BD_WHEN_CHOSEN},
    {"choose", BD_WHEN_ASKED},
    {"visibility", BD_WHEN_ASKED},
    {"gather", 0},
    {"cache", BD_WHEN_SHORT | BD_WHEN_FIRST},
    {"far", BD_WHEN_SHORT},
    {"gloss", BD_WHEN_SHORT | BD_WHEN_GLOSSY},
    {"rough", BD_WHEN_SHORT | BD_WHEN_ROUGH | BD_WHEN_FIRST},
    {"residual", BD_WHEN_SCREEN | BD_WHEN_FIRST},
    {"filter", BD_WHEN_FILTERED},
    {"caustics", BD_WHEN_CAUSTICS},
    {NULL, 0},
};
static const struct bd_param_default defaults[] = {
    {BD_PARAM_VPLS, 1024}, {BD_PARAM_VPL_KERNEL, BD_KERNEL_DISK},
    {BD_PARAM_RAYS, 8},    {BD_PARAM_INDIRECT_BOUNCES, 64},
    {BD_PARAM_CLAMP, 0},
};
static const char *const ladder[] = {
    "vpls=512 rays=4 far_rays=2 walk_vpls=512 cache_cells=512 iterations=1 light_rays=16"
    " photons=32768",
    "vpls=1024 rays=8 far_rays=4 walk_vpls=2048 cache_cells=2048 iterations=2 light_rays=16"
    " photons=131072",
    "vpls=2048 rays=16 far_rays=8 walk_vpls=4096 cache_cells=4096 iterations=2 light_rays=16"
    " photons=262144",
    "vpls=4096 rays=32 far_rays=16 walk_vpls=8192 cache_cells=8192 iterations=3 light_rays=32"
    " photons=524288",
    "vpls=16384 rays=64 far_rays=64 walk_vpls=16384 cache_cells=32768 iterations=4 light_rays=64"
    " photons=1048576",
    NULL,
};

const struct bd_technique bd_technique_ssbc = {
    .name = "ssbc",
    .summary = "all light by clamped virtual lights, and what the clamp takes from the picture",
    .model = {.indirect_bounces = BD_MODEL_BOUNCES_UNLIMITED,
              .indirect_visibility = true,
              .lights = BD_LIGHTS_ALL,
              .glossy_receivers = true,
              .transmission = true,
              .coverage = true,
              .indirect_lights = BD_LIGHTS_ALL},
    .inputs = BD_INPUT_FINAL_GATHER | BD_INPUT_SCREEN,
    .passes = passes,
    .params_read = BD_READS_DIRECT | BD_READS(BD_PARAM_VPLS) | BD_READS_VISIBILITY |
                   BD_READS_LIGHT_PATHS | BD_READS(BD_PARAM_WALK_VPLS) | BD_READS(BD_PARAM_CLAMP) |
                   BD_READS(BD_PARAM_RESIDUAL) | BD_READS(BD_PARAM_FAR_RAYS) |
                   BD_READS(BD_PARAM_CACHE_CELLS) | BD_READS(BD_PARAM_PAPER_MODE) |
                   BD_READS(BD_PARAM_SUB_FRAMES) | BD_READS(BD_PARAM_LIGHT_BLOCKS) |
                   BD_READS(BD_PARAM_ITERATIONS) | BD_READS(BD_PARAM_RESIDUAL_LEVELS) |
                   BD_READS(BD_PARAM_RESIDUAL_THRESHOLD) |
                   BD_READS(BD_PARAM_RESIDUAL_EDGE_THRESHOLD) | BD_READS_CAUSTICS,
    .defaults = defaults,
    .default_count = sizeof defaults / sizeof *defaults,
    .tolerance = {.direct = 1e-3, .indirect = 5e-2},
    .hazard_codes = "S",
    .ladder = ladder,
    .is_sampled = true,
    .indirect = light,
    .light_pixels = bd_far_light_pixels,
    .light_glossy = bd_far_light_anew,
};
