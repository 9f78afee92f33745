#include "technique/fragment_light.h"

#include "pass/upsample.h"

static enum bd_err light(const struct bd_pass_context *context,
                         const struct bd_technique_inputs *inputs, const char *pass,
                         bd_light_fragments_fn *light_fragments, struct bd_multires_light **out,
                         struct bd_fault *fault)
{
    const struct bd_params *params = inputs->params;
    const struct bd_gather_fragments_inputs gather = {
        .scene = inputs->scene,
        .viewpoint = inputs->viewpoint,
        .gbuffer = inputs->gbuffer,
        .discontinuity = inputs->discontinuity,
        .fragments = inputs->fragments,
        .lists = inputs->vpl_lists,
        .list_count = inputs->light_count,
        .near_patches = params->vpl_kernel == BD_KERNEL_PATCH,
        .vector = params->surface_detail == BD_SURFACE_DETAIL_DIRECTION,
        .visit = (enum bd_fragment_visit)params->visit,
    };
    bd_gpu_pass_begin(context->gpu, pass);
    enum bd_err err = light_fragments(context, &gather, out, fault);
    bd_gpu_pass_end(context->gpu);
    return err;
}

static enum bd_err upsample(const struct bd_pass_context *context,
                            const struct bd_technique_inputs *inputs,
                            struct bd_multires_light *light, struct bd_indirect **out,
                            struct bd_fault *fault)
{
    const struct bd_upsample_inputs upsample = {
        .scene = inputs->scene,
        .viewpoint = inputs->viewpoint,
        .gbuffer = inputs->gbuffer,
        .fragments = inputs->fragments,
        .surfaces = inputs->surfaces,
        .light = light,
        .detail = (enum bd_surface_detail)inputs->params->surface_detail,
    };
    bd_gpu_pass_begin(context->gpu, "upsample");
    enum bd_err err = bd_upsample_run(context, &upsample, out, fault);
    bd_gpu_pass_end(context->gpu);
    return err;
}

enum bd_err bd_fragment_light(const struct bd_pass_context *context,
                              const struct bd_technique_inputs *inputs, const char *pass,
                              bd_light_fragments_fn *light_fragments, struct bd_indirect **out,
                              struct bd_fault *fault)
{
    struct bd_multires_light *lit;
    enum bd_err err = light(context, inputs, pass, light_fragments, &lit, fault);
    return err ? err : bd_fragment_light_spread(context, inputs, &lit, out, fault);
}

enum bd_err bd_fragment_light_spread(const struct bd_pass_context *context,
                                     const struct bd_technique_inputs *inputs,
                                     struct bd_multires_light **lit, struct bd_indirect **out,
                                     struct bd_fault *fault)
{
    enum bd_err err = upsample(context, inputs, *lit, out, fault);
    bd_multires_light_destroy(context->gpu, lit);
    if (!err) (*out)->fragment_count = inputs->fragments->count;
    return err;
}
