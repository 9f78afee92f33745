#include "technique/fragment_light.h"

#include <math.h>

#include "base/assert.h"
#include "pass/filter_fragments.h"
#include "pass/gather_chosen_fragments.h"
#include "pass/splat_fragments.h"
#include "pass/upsample.h"

// Fragments with their light, and the lists of those that they were split into.
struct lit {
    struct bd_multires_light *light;
    struct bd_fragments *parts[BD_MULTIRES_LEVEL_MAX];
    uint32_t part_count;
};

bool bd_fragments_have_vectors(const struct bd_params *params, const struct bd_unlit *unlit)
{
    return params->surface_detail == BD_SURFACE_DETAIL_DIRECTION &&
           (!unlit->into || unlit->into->coarse_vector);
}

struct bd_gather_fragments_inputs bd_fragment_inputs(const struct bd_technique_inputs *inputs,
                                                     const struct bd_unlit *unlit)
{
    const struct bd_params *params = inputs->params;
    return (struct bd_gather_fragments_inputs){
        .scene = inputs->scene,
        .viewpoint = inputs->viewpoint,
        .gbuffer = inputs->made.gbuffer,
        .discontinuity = inputs->made.discontinuity,
        .fragments = unlit->fragments,
        .lists = inputs->vpl_lists,
        .list_count = inputs->list_count,
        .near_patches = params->vpl_kernel == BD_KERNEL_PATCH,
        .vector = bd_fragments_have_vectors(params, unlit),
        .visit = (enum bd_fragment_visit)params->visit,
        .spread = unlit->spread,
        .finest_level = params->finest_level,
        .into = unlit->into,
    };
}

enum bd_err bd_fragments_gather(const struct bd_pass_context *context,
                                const struct bd_technique_inputs *inputs,
                                const struct bd_unlit *unlit, struct bd_multires_light **out,
                                struct bd_err_detail *detail)
{
    struct bd_gather_fragments_inputs gather = bd_fragment_inputs(inputs, unlit);
    const struct bd_visibility_inputs visibility = bd_technique_vpl_visibility(inputs);
    const struct bd_gather_chosen_fragments_inputs chosen = {
        .gather = &gather,
        .list = inputs->vpls_in_order,
        .rays = inputs->params->rays,
        .seed = inputs->seed,
        .noise = inputs->filtered,
    };
    if (bd_technique_asks(inputs)) gather.visibility = &visibility;
    if (!inputs->chosen) return bd_gather_fragments_run(context, &gather, out, detail);
    return bd_gather_chosen_fragments_run(context, &chosen, out, detail);
}

enum bd_err bd_fragments_splat(const struct bd_pass_context *context,
                               const struct bd_technique_inputs *inputs,
                               const struct bd_unlit *unlit, struct bd_multires_light **out,
                               struct bd_err_detail *detail)
{
    const struct bd_gather_fragments_inputs splat = bd_fragment_inputs(inputs, unlit);
    bd_gpu_pass_begin(context->gpu, "splat");
    enum bd_err err = bd_splat_fragments_run(context, &splat, out, detail);
    bd_gpu_pass_end(context->gpu);
    return err;
}

static enum bd_err split(const struct bd_pass_context *context,
                         const struct bd_technique_inputs *inputs, const char *pass,
                         const struct bd_fragments *parents, const struct bd_multires_light *light,
                         struct bd_fragments **out, struct bd_err_detail *detail)
{
    const struct bd_discontinuity_inputs seen = {
        .gbuffer = inputs->made.gbuffer,
        .viewpoint = inputs->viewpoint,
        .space = &inputs->scene->space,
    };
    const struct bd_light_of_blocks blocks = {light->coarse, light->coarse_vector};
    bd_gpu_pass_begin(context->gpu, pass);
    enum bd_err err =
        bd_fragments_refine(context, &seen, inputs->made.discontinuity, inputs->made.fragments,
                            parents, &blocks, inputs->params->light_threshold, out, detail);
    bd_gpu_pass_end(context->gpu);
    return err;
}

// Splits what light changes too much over, and lights the parts, until nothing is left to be split.
// Pixels are not split, so there are fewer lists than levels.
static enum bd_err refine(const struct bd_pass_context *context,
                          const struct bd_technique_inputs *inputs, const char *pass,
                          bd_light_fragments_fn *light_fragments, struct lit *lit,
                          struct bd_err_detail *detail)
{
    const struct bd_fragments *last = inputs->made.fragments;
    enum bd_err err = BD_ERR_OK;
    while (!err && last->count > last->level_count[0]) {
        BD_ASSERT(lit->part_count < BD_MULTIRES_LEVEL_MAX);
        struct bd_fragments *parts;
        err = split(context, inputs, pass, last, lit->light, &parts, detail);
        if (err) return err;
        lit->parts[lit->part_count++] = parts;
        last = parts;
        const struct bd_unlit unlit = {.fragments = parts, .spread = true, .into = lit->light};
        struct bd_multires_light *same;
        if (parts->count > 0) err = light_fragments(context, inputs, &unlit, &same, detail);
    }
    return err;
}

static enum bd_err filter(const struct bd_pass_context *context,
                          const struct bd_technique_inputs *inputs, struct lit *lit,
                          struct bd_err_detail *detail)
{
    const struct bd_unlit unlit = {.fragments = inputs->made.fragments};
    const struct bd_gather_fragments_inputs gather = bd_fragment_inputs(inputs, &unlit);
    const struct bd_fragments *lists[BD_MULTIRES_LEVEL_MAX + 1] = {inputs->made.fragments};
    for (uint32_t i = 0; i < lit->part_count; i++) lists[i + 1] = lit->parts[i];
    return bd_filter_fragments_run(context, &gather, lists, lit->part_count + 1,
                                   inputs->variance_part, &lit->light, detail);
}

static uint64_t fragment_count(const struct bd_technique_inputs *inputs, const struct lit *lit)
{
    uint64_t count = inputs->made.fragments->count;
    for (uint32_t i = 0; i < lit->part_count; i++) count += lit->parts[i]->count;
    return count;
}

static void destroy_lit(struct bd_gpu *gpu, struct lit *lit)
{
    bd_multires_light_destroy(gpu, &lit->light);
    for (uint32_t i = 0; i < lit->part_count; i++) bd_fragments_destroy(gpu, &lit->parts[i]);
}

// How light changes is kept beside vectors. Techniques that do not say it have no threshold.
static bool is_refined(const struct bd_params *params)
{
    return params->surface_detail == BD_SURFACE_DETAIL_DIRECTION && !isinf(params->light_threshold);
}

static enum bd_err light(const struct bd_pass_context *context,
                         const struct bd_technique_inputs *inputs, const char *pass,
                         bd_light_fragments_fn *light_fragments, struct lit *lit,
                         struct bd_err_detail *detail)
{
    const struct bd_unlit unlit = {.fragments = inputs->made.fragments,
                                   .spread = is_refined(inputs->params)};
    enum bd_err err = light_fragments(context, inputs, &unlit, &lit->light, detail);
    if (!err && unlit.spread) err = refine(context, inputs, pass, light_fragments, lit, detail);
    return err;
}

static enum bd_err upsample(const struct bd_pass_context *context,
                            const struct bd_technique_inputs *inputs, const struct lit *lit,
                            struct bd_indirect **out, struct bd_err_detail *detail)
{
    enum bd_surface_detail shown = (enum bd_surface_detail)inputs->params->surface_detail;
    if (!lit->light->coarse_vector && shown == BD_SURFACE_DETAIL_DIRECTION)
        shown = BD_SURFACE_DETAIL_OFF;
    const struct bd_upsample_inputs upsample = {
        .scene = inputs->scene,
        .viewpoint = inputs->viewpoint,
        .gbuffer = inputs->made.gbuffer,
        .fragments = inputs->made.fragments,
        .parts = lit->parts,
        .part_count = lit->part_count,
        .surfaces = inputs->made.surfaces,
        .light = lit->light,
        .detail = shown,
        .keep_vector = inputs->normal_maps && shown == BD_SURFACE_DETAIL_DIRECTION,
    };
    bd_gpu_pass_begin(context->gpu, "upsample");
    enum bd_err err = bd_upsample_run(context, &upsample, out, detail);
    bd_gpu_pass_end(context->gpu);
    if (err) return err;
    (*out)->fragment_count = fragment_count(inputs, lit);
    (*out)->rays = lit->light->rays;
    return BD_ERR_OK;
}

enum bd_err bd_fragment_light(const struct bd_pass_context *context,
                              const struct bd_technique_inputs *inputs, const char *pass,
                              bd_light_fragments_fn *light_fragments, struct bd_indirect **out,
                              struct bd_err_detail *detail)
{
    struct lit lit = {0};
    enum bd_err err = light(context, inputs, pass, light_fragments, &lit, detail);
    if (!err && inputs->filtered && lit.light->fine_noise)
        err = filter(context, inputs, &lit, detail);
    if (!err) err = upsample(context, inputs, &lit, out, detail);
    destroy_lit(context->gpu, &lit);
    return err;
}
