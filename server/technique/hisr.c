// Technique `hisr`, hierarchical image-space radiosity (algorithms.md A2.4): one diffuse bounce
// from a tree over each light's map, of which each fragment takes the cut that is good enough for
// it.
//
// Paper:  Nichols, Shopf and Wyman 2009, 3.5; criterion `lightcuts`: Walter et al. 2005
// Exact when: as `multires_gather` is, and tau goes to 0
// Known:  what is known of `multires_gather`; a cut changes from one fragment to the next, and
//         where the light is smooth that shows as steps of up to `tau`; light of receivers'
//         specular lobes is left out (`glossy_as_diffuse`); a node has two lobes, foliage more

#include "pass/choose_tree.h"
#include "pass/gather_chosen_fragments.h"
#include "pass/upsample.h"
#include "technique/fragment_light.h"

// Of nodes of its cut that each fragment sees.
static enum bd_err gather_chosen(const struct bd_pass_context *context,
                                 const struct bd_technique_inputs *inputs,
                                 const struct bd_unlit *unlit,
                                 const struct bd_gather_tree_inputs *trees,
                                 struct bd_multires_light **out, struct bd_err_detail *detail)
{
    struct bd_gather_fragments_inputs gather = bd_fragment_inputs(inputs, unlit);
    struct bd_tree_choice *choice;
    gather.visibility = trees->visibility;
    enum bd_err err = bd_tree_choice_create(context, trees, inputs->params->rays, &choice, detail);
    if (err) return err;
    const struct bd_gather_chosen_fragments_inputs chosen = {
        .gather = &gather,
        .choice = bd_tree_choice_get(choice),
        .rays = inputs->params->rays,
        .seed = inputs->seed,
        .noise = inputs->filtered,
    };
    err = bd_gather_chosen_fragments_run(context, &chosen, out, detail);
    bd_tree_choice_destroy(&choice);
    return err;
}

// Where all leaves are asked, no tree is of use.
static enum bd_err gather(const struct bd_pass_context *context,
                          const struct bd_technique_inputs *inputs, const struct bd_unlit *unlit,
                          struct bd_multires_light **out, struct bd_err_detail *detail)
{
    const struct bd_params *params = inputs->params;
    const struct bd_visibility_inputs visibility = bd_technique_vpl_visibility(inputs);
    const struct bd_gather_tree_inputs gather = {
        .scene = inputs->scene,
        .viewpoint = inputs->viewpoint,
        .gbuffer = inputs->made.gbuffer,
        .trees = inputs->vpl_trees,
        .leaves = inputs->vpl_lists,
        .tree_count = inputs->list_count,
        .criterion =
            params->paper_mode ? BD_TREE_PRINTED : (enum bd_tree_criterion)params->tree_cut,
        .tau = params->tau,
        .near_patches = params->vpl_kernel == BD_KERNEL_PATCH,
        .discontinuity = inputs->made.discontinuity,
        .fragments = unlit->fragments,
        .vector = bd_fragments_have_vectors(params, unlit),
        .spread = unlit->spread,
        .finest_level = params->finest_level,
        .into = unlit->into,
        .visibility = &visibility,
    };
    if (inputs->chosen) return gather_chosen(context, inputs, unlit, &gather, out, detail);
    if (bd_technique_asks(inputs)) return bd_fragments_gather(context, inputs, unlit, out, detail);
    bd_gpu_pass_begin(context->gpu, "gather");
    enum bd_err err = bd_gather_tree_fragments_run(context, &gather, out, detail);
    bd_gpu_pass_end(context->gpu);
    return err;
}

static enum bd_err light_fragments(const struct bd_pass_context *context,
                                   const struct bd_technique_inputs *inputs,
                                   struct bd_indirect **out, struct bd_err_detail *detail)
{
    return bd_fragment_light(context, inputs, "gather", gather, out, detail);
}

static const struct bd_technique_pass passes[] = {BD_FRAGMENT_PASSES, {NULL, 0}};
static const char *const ladder[] = {
    "vpls=1024 tau=0.1 depth_threshold=0.2 normal_threshold=1",
    "vpls=4096 tau=0.05 depth_threshold=0.1 normal_threshold=0.5",
    "vpls=65536 tau=0.03 depth_threshold=0.05 normal_threshold=0.25",
    "vpls=65536 tau=0.01 depth_threshold=0.02 normal_threshold=0.1",
    "vpls=65536 tau=0.005 depth_threshold=0.01 normal_threshold=0.05",
    "vpls=65536 tau=0.003 depth_threshold=0.005 normal_threshold=0.02",
    "vpls=65536 tau=0.002 depth_threshold=0 normal_threshold=0",
    NULL,
};

// The paper's tree: a leaf for each texel of a map of 256 squared; of a light with six faces 128
// squared a face, 98,304, at two texels a side. Its time hardly grows with the number of leaves.
//
// `tau` = .03, the table's, is the largest step with less than 3 % relative RMSE against all leaves
// summed, on ten scenes of eleven (tests/bench/results/NOTES.md); leaves of plants have more
// normals than two lobes hold.
static const struct bd_param_default defaults[] = {{BD_PARAM_VPLS, 65536}, BD_DEFAULT_VISIBILITY};

const struct bd_technique bd_technique_hisr = {
    .name = "hisr",
    .summary =
        "one bounce from a tree of virtual lights, a cut of it for each smooth block of pixels",
    .model = {.indirect_bounces = 1,
              .lights = BD_LIGHTS_ALL,
              .indirect_lights = BD_LIGHTS_ALL,
              .transmission = true,
              .coverage = true},
    .inputs = BD_INPUT_VPL_GRID | BD_INPUT_VPL_TREE | BD_INPUT_FRAGMENTS,
    .passes = passes,
    .params_read = BD_READS_VPL_GRID | BD_READS_LIGHT_PATHS | BD_READS_VISIBILITY |
                   BD_READS_FRAGMENTS | BD_READS(BD_PARAM_LIGHT_THRESHOLD) |
                   BD_READS(BD_PARAM_TREE_CUT) | BD_READS(BD_PARAM_TAU) |
                   BD_READS(BD_PARAM_TREE_ROOTS) | BD_READS(BD_PARAM_SUB_FRAMES),
    .defaults = defaults,
    .default_count = sizeof defaults / sizeof *defaults,
    // More VPLs than that, and `rsm` is off in a sphere of facets too.
    .tolerance = {.direct = 1e-3, .indirect = 1e-2, .settings = "vpls=4096 tau=0.001"},
    .hazard_codes = "TN",
    .ladder = ladder,
    .indirect = light_fragments,
    .light_pixels = gather,
};
