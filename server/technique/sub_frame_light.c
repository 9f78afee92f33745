#include "technique/sub_frame_light.h"

#include "pass/shared_light.h"
#include "pass/upsample.h"

bool bd_technique_shares(const struct bd_technique *technique, const struct bd_params *params,
                         bool glossy_receivers)
{
    if (!technique->light_pixels || params->sub_frames == BD_SUB_FRAMES_OWN) return false;
    // The paper's detail darkens a pixel by what only its own blocks know.
    bool blocks = technique->inputs & BD_INPUT_FRAGMENTS;
    if (blocks && params->surface_detail == BD_SURFACE_DETAIL_PAPER) return false;
    // What the picture alone gives back, single pixels do not know.
    if (technique->inputs & BD_INPUT_SCREEN && !bd_params_bring_back(params)) return false;
    return !glossy_receivers || technique->light_glossy;
}

// Pixels alone, which go to where the others are.
static enum bd_err light_missing(const struct bd_pass_context *context,
                                 const struct bd_technique *technique,
                                 const struct bd_technique_inputs *inputs,
                                 const struct bd_shared_light *shared, struct bd_err_detail *detail)
{
    struct bd_technique_inputs own = *inputs;
    own.made.discontinuity = shared->pixels;
    own.made.fragments = shared->missing;
    struct bd_multires_light into = {.layout = shared->pixels->layout,
                                     .fine = shared->indirect->irradiance};
    const struct bd_unlit unlit = {.fragments = shared->missing, .into = &into};
    struct bd_multires_light *same;
    if (shared->missing->count == 0) return BD_ERR_OK;
    enum bd_err err = technique->light_pixels(context, &own, &unlit, &same, detail);
    if (!err) bd_ray_counts_add(&shared->indirect->rays, into.rays);
    return err;
}

enum bd_err bd_sub_frame_light(const struct bd_pass_context *context,
                               const struct bd_technique *technique,
                               const struct bd_technique_inputs *inputs,
                               const struct bd_first_sub_frame *first, struct bd_indirect **out,
                               struct bd_err_detail *detail)
{
    const struct bd_shared_light_inputs share = {
        .scene = inputs->scene,
        .viewpoint = inputs->viewpoint,
        .gbuffer = inputs->made.gbuffer,
        .first_viewpoint = first->viewpoint,
        .blocks = first->blocks,
        .first_gbuffer = first->gbuffer,
        .first = first->indirect,
    };
    struct bd_shared_light shared;
    bd_gpu_pass_begin(context->gpu, "share");
    enum bd_err err = bd_shared_light_run(context, &share, &shared, detail);
    bd_gpu_pass_end(context->gpu);
    if (err) return err;
    struct bd_technique_inputs own = *inputs;
    own.cells = first->indirect->cells;
    err = light_missing(context, technique, &own, &shared, detail);
    if (!err && inputs->glossy_receivers)
        err = technique->light_glossy(context, &own, shared.indirect, detail);
    if (!err) {
        *out = shared.indirect;
        shared.indirect = NULL;
    }
    bd_shared_light_finish(context->gpu, &shared);
    return err;
}
