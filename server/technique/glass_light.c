#include "technique/glass_light.h"

#include "pass/gloss.h"

// Virtual lights that a place is asked of.
#define VPL_RAYS 8u

enum bd_err bd_glass_light(const struct bd_pass_context *context,
                           const struct bd_technique_inputs *inputs,
                           const struct bd_visibility_inputs *visibility, uint32_t rays,
                           struct bd_indirect **out, struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs of_vpls = bd_technique_vpl_visibility(inputs);
    const struct bd_vpl_list *list = inputs->vpls_in_order;
    const struct bd_far_inputs far = {
        .snapshot = inputs->snapshot,
        .visibility = visibility,
        .first = inputs->first_light,
        .rays = rays,
        .seed = inputs->seed_of_sub_frame,
        .sends = BD_SENDS_ALL,
        .glass = BD_GLASS_PASSES,
        .seen = {list && list->count > 0 ? list : NULL, VPL_RAYS, &of_vpls},
    };
    struct bd_gather_inputs gather = bd_technique_gather_inputs(inputs);
    gather.glossy = false;
    return bd_gloss_of_glass_run(context, &far, &gather, out, detail);
}
