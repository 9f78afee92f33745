#include "technique/far_light.h"

#include "pass/cache.h"
#include "pass/filter_light.h"
#include "pass/gather_chosen_fragments.h"
#include "pass/gloss.h"
#include "pass/light_paths.h"
#include "pass/lit_points.h"
#include "pass/photon_density.h"
#include "pass/photons.h"
#include "technique/fragment_light.h"

// Of a cell of the cache: what many pixels share is worth many rays.
#define CELL_VPL_RAYS 32u
#define CELL_FAR_RAYS 16u
// From so many on it does not show which is the last.
#define ANY_BOUNCES 16u

// Each kind of light path has one map of what lamps send through glass.
static const struct bd_photon_map *caustics_of(const struct bd_technique_inputs *inputs)
{
    if (inputs->photons) return inputs->photons->caustics;
    if (inputs->points) return inputs->points->caustics;
    return inputs->light_paths->caustics;
}

// Photons that bring all light, and points, have this among the rest of theirs.
static const struct bd_photon_map *caustics_again_of(const struct bd_technique_inputs *inputs)
{
    if (inputs->photons || inputs->points) return NULL;
    return inputs->light_paths->caustics_again;
}

static const struct bd_irradiance_cells *cells_of(const struct bd_technique_inputs *inputs)
{
    if (inputs->photons) return inputs->photons->cells;
    return inputs->points ? inputs->points->cells : inputs->cells;
}

struct bd_far_inputs bd_far_of(const struct bd_technique_inputs *inputs,
                               const struct bd_visibility_inputs *visibility, uint32_t rays)
{
    return (struct bd_far_inputs){
        .snapshot = inputs->snapshot,
        .visibility = visibility,
        .cells = cells_of(inputs),
        .first = inputs->first_light,
        .rays = rays,
        .seed = inputs->seed_of_sub_frame,
        .sends = inputs->params->lambert ? BD_SENDS_LAMBERT : BD_SENDS_ALL,
        .glass = inputs->glass ? BD_GLASS_PASSES : BD_GLASS_HIDES,
        .caustics = caustics_of(inputs),
        .caustics_again = caustics_again_of(inputs),
    };
}

struct bd_far_inputs bd_far_of_list(const struct bd_technique_inputs *inputs,
                                    const struct bd_visibility_inputs *visibility,
                                    const struct bd_vpl_list *list, uint32_t rays)
{
    struct bd_far_inputs far = bd_far_of(inputs, visibility, rays);
    far.area = list->soft_area;
    far.clamp = list->clamp;
    return far;
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
        .goes_round = inputs->params->indirect_bounces >= ANY_BOUNCES,
        .are_shown = inputs->glossy_receivers || inputs->glass,
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

// What lies behind glass, and behind glass again.
#define MAPS 2u

static struct bd_photon_density_inputs density_of(const struct bd_technique_inputs *inputs,
                                                  const struct bd_visibility_inputs *visibility,
                                                  uint32_t map)
{
    return (struct bd_photon_density_inputs){.map = map == 0 ? caustics_of(inputs)
                                                             : caustics_again_of(inputs),
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
    return err ? err : bd_far_light_add_caustics(context, inputs, &gather, *out, detail);
}

enum bd_err bd_far_light_add_caustics(const struct bd_pass_context *context,
                                      const struct bd_technique_inputs *inputs,
                                      const struct bd_gather_fragments_inputs *gather,
                                      struct bd_multires_light *light, struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < MAPS; i++) {
        const struct bd_photon_density_inputs density = density_of(inputs, &visibility, i);
        if (density.map) err = bd_photon_density_add(context, &density, gather, light, detail);
    }
    return err;
}

enum bd_err bd_far_light_caustics(const struct bd_pass_context *context,
                                  const struct bd_technique_inputs *inputs,
                                  const struct bd_gather_inputs *gather,
                                  struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < MAPS; i++) {
        const struct bd_photon_density_inputs density = density_of(inputs, &visibility, i);
        if (density.map) err = bd_photon_density_run(context, &density, gather, indirect, detail);
    }
    return err;
}

enum bd_err bd_far_light_lobes(const struct bd_pass_context *context,
                               const struct bd_technique_inputs *inputs,
                               const struct bd_far_inputs *far,
                               const struct bd_gather_inputs *gather, struct bd_indirect *indirect,
                               struct bd_err_detail *detail)
{
    struct bd_far_inputs of_rough = *far;
    enum bd_err err = BD_ERR_OK;
    if (inputs->glossy_receivers) err = bd_gloss_run(context, far, gather, indirect, detail);
    of_rough.rays = bd_few_rays(far->rays);
    if (!err && inputs->rough_receivers)
        err = bd_gloss_of_rough_run(context, &of_rough, gather, indirect, detail);
    return err;
}

static enum bd_err smooth_lobes(const struct bd_pass_context *context,
                                const struct bd_technique_inputs *inputs,
                                const struct bd_gather_inputs *gather, struct bd_indirect *indirect,
                                struct bd_err_detail *detail)
{
    const struct bd_smoothing smoothing = {BD_FAR_FILTER_LEVELS, inputs->variance_part, true};
    if (!inputs->filtered) return BD_ERR_OK;
    return bd_filter_light_run(context, gather, &smoothing, indirect, detail);
}

static struct bd_gather_inputs gather_of(const struct bd_technique_inputs *inputs,
                                         const struct bd_visibility_inputs *visibility)
{
    struct bd_gather_inputs gather = bd_technique_gather_inputs(inputs);
    gather.visibility = visibility;
    gather.glossy = false;
    return gather;
}

enum bd_err bd_far_light_beside(const struct bd_pass_context *context,
                                const struct bd_technique_inputs *inputs,
                                struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    const struct bd_gather_inputs gather = gather_of(inputs, &visibility);
    const struct bd_far_inputs far = bd_far_of(inputs, &visibility, inputs->params->far_rays);
    enum bd_err err = bd_far_light_lobes(context, inputs, &far, &gather, indirect, detail);
    if (!err) err = smooth_lobes(context, inputs, &gather, indirect, detail);
    return err ? err : bd_far_light_caustics(context, inputs, &gather, indirect, detail);
}

enum bd_err bd_far_light_anew(const struct bd_pass_context *context,
                              const struct bd_technique_inputs *inputs,
                              struct bd_indirect *indirect, struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    const uint32_t rays = inputs->params->far_rays;
    const struct bd_gather_inputs gather = gather_of(inputs, &visibility);
    const struct bd_far_inputs far =
        bd_far_of(inputs, &visibility, inputs->alone ? rays : bd_few_rays(rays));
    enum bd_err err = bd_gloss_run(context, &far, &gather, indirect, detail);
    if (!err) err = smooth_lobes(context, inputs, &gather, indirect, detail);
    for (uint32_t i = 0; !err && i < MAPS; i++) {
        const struct bd_photon_density_inputs density = density_of(inputs, &visibility, i);
        if (density.map)
            err = bd_photon_density_run_lobes(context, &density, &gather, indirect, detail);
    }
    return err;
}
