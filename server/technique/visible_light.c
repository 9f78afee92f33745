#include "technique/visible_light.h"

#include "pass/filter_light.h"
#include "pass/gather_chosen.h"

static enum bd_err light(const struct bd_pass_context *context,
                         const struct bd_technique_inputs *inputs, struct bd_gather_inputs *gather,
                         struct bd_indirect **out, struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs visibility = bd_technique_vpl_visibility(inputs);
    const struct bd_gather_chosen_inputs chosen = {gather, inputs->vpls_in_order,
                                                   inputs->params->rays, inputs->seed};
    const struct bd_smoothing smoothing = {bd_filter_levels_of_chosen(chosen.rays),
                                           inputs->variance_part, false};
    if (bd_technique_asks(inputs)) gather->visibility = &visibility;
    if (!inputs->chosen) return bd_gather_run(context, gather, out, detail);
    enum bd_err err = bd_gather_chosen_run(context, &chosen, out, detail);
    if (err || !inputs->filtered) return err;
    err = bd_filter_light_run(context, gather, &smoothing, *out, detail);
    if (err) bd_indirect_destroy(context->gpu, out);
    return err;
}

enum bd_err bd_visible_light(const struct bd_pass_context *context,
                             const struct bd_technique_inputs *inputs, struct bd_indirect **out,
                             struct bd_err_detail *detail)
{
    struct bd_gather_inputs gather = bd_technique_gather_inputs(inputs);
    return light(context, inputs, &gather, out, detail);
}

enum bd_err bd_visible_lobes(const struct bd_pass_context *context,
                             const struct bd_technique_inputs *inputs, struct bd_indirect *indirect,
                             struct bd_err_detail *detail)
{
    struct bd_gather_inputs gather = bd_technique_gather_inputs(inputs);
    struct bd_indirect *lobes;
    gather.lobes_alone = true;
    enum bd_err err = light(context, inputs, &gather, &lobes, detail);
    if (err) return err;
    indirect->glossy = lobes->glossy;
    lobes->glossy = NULL;
    bd_ray_counts_add(&indirect->rays, lobes->rays);
    bd_indirect_destroy(context->gpu, &lobes);
    return BD_ERR_OK;
}
