#include "technique/visible_light.h"

#include "pass/filter_light.h"
#include "pass/gather_chosen.h"

enum bd_err bd_visible_light(const struct bd_pass_context *context,
                             const struct bd_technique_inputs *inputs, struct bd_indirect **out,
                             struct bd_fault *fault)
{
    struct bd_gather_inputs gather = bd_technique_gather_inputs(inputs);
    const struct bd_visibility_inputs visibility = {
        inputs->rays, inputs->pool, (enum bd_rays_alpha)inputs->params->alpha_coverage};
    const struct bd_gather_chosen_inputs chosen = {
        &gather, inputs->vpls_in_order, inputs->params->rays, inputs->seed};
    if (inputs->rays) gather.visibility = &visibility;
    if (!inputs->chosen) return bd_gather_run(context, &gather, out, fault);
    enum bd_err err = bd_gather_chosen_run(context, &chosen, out, fault);
    if (err || !inputs->filtered) return err;
    err = bd_filter_light_run(context, &gather, chosen.rays, *out, fault);
    if (err) bd_indirect_destroy(context->gpu, out);
    return err;
}
