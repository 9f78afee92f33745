#include "technique/glossy_light.h"

#include "pass/glossy_blocks.h"
#include "pass/subsplats.h"

// The blocks that all lists begin with.
static enum bd_err find_blocks(const struct bd_pass_context *context,
                               const struct bd_technique_inputs *inputs, enum bd_glossy_light where,
                               struct bd_discontinuity **out, struct bd_err_detail *detail)
{
    const struct bd_glossy_blocks_inputs blocks = {
        .gbuffer = inputs->made.gbuffer,
        .viewpoint = inputs->viewpoint,
        .space = &inputs->scene->space,
        .discontinuity = inputs->made.discontinuity,
        .normal_threshold = inputs->params->normal_threshold,
        .material_threshold = inputs->params->material_threshold,
    };
    if (where == BD_GLOSSY_LIGHT_AT_PIXELS)
        return bd_glossy_pixels(context->gpu, inputs->viewpoint, out, detail);
    return bd_glossy_blocks_run(context, &blocks, out, detail);
}

static enum bd_err find_start(const struct bd_pass_context *context,
                              const struct bd_technique_inputs *inputs, enum bd_glossy_light where,
                              struct bd_fragments **out, struct bd_err_detail *detail)
{
    const struct bd_discontinuity_inputs seen = {
        .gbuffer = inputs->made.gbuffer,
        .viewpoint = inputs->viewpoint,
        .space = &inputs->scene->space,
    };
    struct bd_discontinuity *blocks;
    enum bd_err err = find_blocks(context, inputs, where, &blocks, detail);
    if (err) return err;
    err = bd_fragments_run(context, &seen, blocks, BD_REFINEMENT_ONE_PASS, out, detail);
    bd_discontinuity_destroy(context->gpu, &blocks);
    return err;
}

static enum bd_err add(const struct bd_pass_context *context,
                       const struct bd_technique_inputs *inputs, enum bd_glossy_light where,
                       struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    const struct bd_params *params = inputs->params;
    struct bd_fragments *start;
    enum bd_err err = find_start(context, inputs, where, &start, detail);
    if (err) return err;
    const struct bd_subsplats_inputs subsplats = {
        .scene = inputs->scene,
        .viewpoint = inputs->viewpoint,
        .gbuffer = inputs->made.gbuffer,
        .start = start,
        .irradiance = indirect->irradiance,
        .lists = inputs->vpl_lists,
        .list_count = inputs->list_count,
        .near_patches = params->vpl_kernel == BD_KERNEL_PATCH,
        .test = (enum bd_radiance_test)params->radiance_test,
        .threshold = params->radiance_threshold,
        .block_limit = params->subsplat_limit,
    };
    struct bd_subsplat_counts counts;
    err = bd_subsplats_run(context, &subsplats, &indirect->glossy, &counts, detail);
    // Of pixels there is nothing to tell.
    if (!err && where == BD_GLOSSY_LIGHT_AT_BLOCKS) indirect->subsplats = counts;
    bd_fragments_destroy(context->gpu, &start);
    return err;
}

enum bd_err bd_glossy_light(const struct bd_pass_context *context,
                            const struct bd_technique_inputs *inputs, enum bd_glossy_light where,
                            struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    bd_gpu_pass_begin(context->gpu, where == BD_GLOSSY_LIGHT_AT_PIXELS ? "glossy" : "subsplats");
    enum bd_err err = add(context, inputs, where, indirect, detail);
    bd_gpu_pass_end(context->gpu);
    return err;
}
