#include "technique/far_light.h"

#include "pass/cache.h"
#include "pass/filter_light.h"
#include "pass/gather_chosen_fragments.h"
#include "pass/gloss.h"
#include "pass/light_paths.h"
#include "pass/photon_density.h"
#include "technique/fragment_light.h"

// Of a cell of the cache: what many pixels share is worth many rays.
#define CELL_VPL_RAYS 32u
#define CELL_FAR_RAYS 16u

struct bd_far_inputs bd_far_of_list(const struct bd_technique_inputs *inputs,
                                    const struct bd_visibility_inputs *visibility,
                                    const struct bd_vpl_list *list, uint32_t rays)
{
    return (struct bd_far_inputs){
        .snapshot = inputs->snapshot,
        .visibility = visibility,
        .first = inputs->first_light,
        .area = list->soft_area,
        .clamp = list->clamp,
        .rays = rays,
        .seed = inputs->seed_of_sub_frame,
        .sends = inputs->params->lambert ? BD_SENDS_LAMBERT : BD_SENDS_ALL,
        .glass = inputs->glass ? BD_GLASS_PASSES : BD_GLASS_HIDES,
        .caustics = inputs->light_paths->caustics,
    };
}

enum bd_err bd_far_light_cache(const struct bd_pass_context *context,
                               const struct bd_technique_inputs *inputs,
                               const struct bd_gather_inputs *gather,
                               struct bd_irradiance_cells **out, struct bd_ray_counts *traced,
                               struct bd_err_detail *detail)
{
    const struct bd_light_paths *paths = inputs->light_paths;
    const struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    struct bd_cache_inputs cache = {
        .gather = gather,
        .far = bd_far_of_list(inputs, &visibility, paths->all, CELL_FAR_RAYS),
        .list = paths->all,
        .vpl_rays = CELL_VPL_RAYS,
        .cells = inputs->params->cache_cells,
    };
    *out = NULL;
    if (inputs->params->indirect_bounces == 1) return BD_ERR_OK;
    cache.far.points = paths->further;
    return bd_cache_run(context, &cache, out, traced, detail);
}

// Of a sub-frame that takes the most of its light over, what it lights itself: where no other one's
// noise is added to it, as much as a filter would leave of it.
#define ALONE_RAYS 16u

static uint32_t own_rays(const struct bd_technique_inputs *inputs, uint32_t rays)
{
    if (!inputs->alone) return bd_few_rays(rays);
    return rays > ALONE_RAYS ? rays : ALONE_RAYS;
}

static struct bd_photon_density_inputs caustics_of(const struct bd_technique_inputs *inputs,
                                                   const struct bd_visibility_inputs *visibility)
{
    return (struct bd_photon_density_inputs){.map = inputs->light_paths->caustics,
                                             .snapshot = inputs->snapshot,
                                             .visibility = visibility,
                                             .pool = inputs->pool,
                                             .lambert = inputs->params->lambert,
                                             .pass = "caustics"};
}

enum bd_err bd_far_light_pixels(const struct bd_pass_context *context,
                                const struct bd_technique_inputs *inputs,
                                const struct bd_unlit *unlit, struct bd_multires_light **out,
                                struct bd_err_detail *detail)
{
    const struct bd_light_paths *paths = inputs->light_paths;
    const struct bd_vpl_list *list = paths->clamped ? paths->clamped : paths->first;
    const struct bd_visibility_inputs rays = bd_technique_visibility(inputs);
    const struct bd_visibility_inputs of_vpls = bd_technique_vpl_visibility(inputs);
    struct bd_gather_fragments_inputs gather = bd_fragment_inputs(inputs, unlit);
    gather.visibility = &of_vpls;
    gather.vector = false;
    const struct bd_gather_chosen_fragments_inputs chosen = {
        .gather = &gather,
        .list = list,
        .rays = own_rays(inputs, bd_chosen_rays(inputs->params)),
        .seed = (uint32_t)inputs->seed_of_sub_frame,
    };
    struct bd_far_inputs far =
        bd_far_of_list(inputs, &rays, list, own_rays(inputs, inputs->params->far_rays));
    far.cells = inputs->cells;
    enum bd_err err = bd_gather_chosen_fragments_run(context, &chosen, out, detail);
    if (!err) err = bd_far_of_fragments(context, &far, &gather, *out, detail);
    if (err || !paths->caustics) return err;
    const struct bd_photon_density_inputs density = caustics_of(inputs, &rays);
    return bd_photon_density_add(context, &density, &gather, *out, detail);
}

enum bd_err bd_far_light_caustics(const struct bd_pass_context *context,
                                  const struct bd_technique_inputs *inputs,
                                  const struct bd_gather_inputs *gather,
                                  struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    const struct bd_photon_density_inputs density = caustics_of(inputs, &visibility);
    if (!density.map) return BD_ERR_OK;
    return bd_photon_density_run(context, &density, gather, indirect, detail);
}

enum bd_err bd_far_light_lobes(const struct bd_pass_context *context,
                               const struct bd_technique_inputs *inputs,
                               struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    const uint32_t rays = inputs->params->far_rays;
    struct bd_gather_inputs gather = bd_technique_gather_inputs(inputs);
    struct bd_far_inputs far = bd_far_of_list(inputs, &visibility, inputs->light_paths->first,
                                              inputs->alone ? rays : bd_few_rays(rays));
    gather.visibility = &visibility;
    gather.glossy = false;
    far.cells = inputs->cells;
    enum bd_err err = bd_gloss_run(context, &far, &gather, indirect, detail);
    const struct bd_smoothing smoothing = {BD_FAR_FILTER_LEVELS, inputs->variance_part, true};
    if (!err && inputs->filtered)
        err = bd_filter_light_run(context, &gather, &smoothing, indirect, detail);
    const struct bd_photon_density_inputs density = caustics_of(inputs, &visibility);
    if (err || !density.map) return err;
    return bd_photon_density_run_lobes(context, &density, &gather, indirect, detail);
}
