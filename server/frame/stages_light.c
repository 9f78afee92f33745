// How what is made for each light, whoever looks, is run.

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "frame/memo.h"
#include "frame/stages.h"
#include "pass/vpl_order.h"

static void release_weights(void *owner, void *output)
{
    struct bd_rsm_weight_map *map = output;
    bd_rsm_weight_map_release(((struct bd_renderer *)owner)->gpu, &map);
}

enum bd_err bd_run_shadow_map(struct bd_frame *frame, struct bd_frame_light *light)
{
    const uint32_t side = frame->plan->params.shadow_size;
    const struct bd_tracer *tracer =
        bd_stage_tracer(frame, bd_light_setup_texels(&light->setup, side));
    return bd_shadow_map_render(&frame->context, frame->scene, &light->setup, side, tracer,
                                &light->shadow_map, frame->detail);
}

// What a moved light keeps, and one whose scene changes: no pass of its own. Six faces of 256 take
// the processor four times as long as it takes to draw the map. Directional weights are areas in
// render units; those of the others have no length in them.
static enum bd_err find_weights(struct bd_frame *frame, struct bd_rsm_inputs *inputs)
{
    struct bd_memo *memo = frame->renderer->memo;
    const struct bd_light_setup *setup = inputs->light;
    const bool is_directional = setup->light->kind == BD_LIGHT_DIRECTIONAL;
    const double numbers[] = {setup->half_width, setup->half_height, setup->light->cone_inner,
                              setup->light->cone_outer,
                              is_directional ? inputs->scene->space.render_per_m : 0};
    uint64_t key = bd_key_bytes(bd_key_begin("rsm_weights"), numbers, sizeof numbers);
    key = bd_key_number(key, (uint64_t)setup->light->kind << 8 | setup->face_count);
    key = bd_key_number(key, (uint64_t)inputs->side_px << 1 | inputs->paper_mode);
    inputs->weights = bd_memo_find(memo, key);
    if (inputs->weights) return BD_ERR_OK;
    enum bd_err err =
        bd_rsm_weight_map_create(&frame->context, inputs, &inputs->weights, frame->detail);
    if (err) return err;
    bd_memo_store(memo, key, inputs->weights, bd_tex_bytes(inputs->weights->tex), release_weights);
    return BD_ERR_OK;
}

enum bd_err bd_run_rsm(struct bd_frame *frame, struct bd_frame_light *light)
{
    const struct bd_params *params = &frame->plan->params;
    struct bd_rsm_inputs inputs = {
        .scene = frame->scene,
        .light = &light->setup,
        .side_px = light->rsm_size,
        .lambert = params->lambert,
        .paper_mode = params->paper_mode,
        .tracer = bd_stage_tracer(frame, bd_light_setup_texels(&light->setup, light->rsm_size)),
    };
    enum bd_err err = find_weights(frame, &inputs);
    return err ? err : bd_rsm_render(&frame->context, &inputs, &light->rsm, frame->detail);
}

enum bd_err bd_run_vpl_grid(struct bd_frame *frame, struct bd_frame_light *light)
{
    const struct bd_params *params = &frame->plan->params;
    const struct bd_vpl_grid_inputs inputs = {
        .rsm = light->rsm,
        .light = &light->setup,
        .space = &frame->scene->space,
        .grid_side = light->grid_side,
        .kernel = (enum bd_vpl_kernel)params->vpl_kernel,
        .near_field = params->near_field,
    };
    return bd_vpl_grid_run(&frame->context, &inputs, &light->vpls, frame->detail);
}

static struct bd_vpl_clusters_inputs
clusters_inputs(const struct bd_frame *frame, const struct bd_frame_light *light, uint32_t levels)
{
    const struct bd_params *params = &frame->plan->params;
    const uint32_t side = light->rsm_size;
    const struct bd_multires_layout layout = bd_multires_layout_of(side, side, light->grid_side);
    const uint32_t coarsest = layout.level_count - 1;
    return (struct bd_vpl_clusters_inputs){
        .rsm = light->rsm,
        .light = &light->setup,
        .space = &frame->scene->space,
        .settings =
            {
                .depth_test = (enum bd_depth_test)params->depth_test,
                .normal_test = (enum bd_normal_test)params->normal_test,
                .neighbourhood = (enum bd_neighbourhood)params->neighbourhood,
                .depth_threshold = params->cluster_depth_threshold,
                .normal_threshold = params->cluster_normal_threshold,
                .coarsest_side = light->grid_side,
            },
        .finest_block_texels = 1u << (coarsest > levels ? coarsest - levels : 0),
        .kernel = (enum bd_vpl_kernel)params->vpl_kernel,
        .near_field = params->near_field,
    };
}

// Split less often where there would be more than may be.
enum bd_err bd_run_vpl_clusters(struct bd_frame *frame, struct bd_frame_light *light)
{
    uint32_t levels = frame->plan->params.cluster_levels;
    for (;; levels--) {
        const struct bd_vpl_clusters_inputs inputs = clusters_inputs(frame, light, levels);
        enum bd_err err =
            bd_vpl_clusters_run(&frame->context, &inputs, &light->vpls, frame->detail);
        const uint32_t most = light->clusters_most;
        if (err || most == 0 || light->vpls->count <= most || levels == 0) return err;
        bd_vpl_list_destroy(frame->renderer->gpu, &light->vpls);
    }
}

enum bd_err bd_run_emitters(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    bd_slicer_work(frame->context.slicer, "emitters");
    return bd_area_lights_create(frame->snapshot, frame->plan->veils, bd_slicer_pause,
                                 frame->context.slicer, &frame->emitters, frame->detail);
}

enum bd_err bd_run_vpl_tree(struct bd_frame *frame, struct bd_frame_light *light)
{
    const struct bd_vpl_tree_inputs inputs = {
        .leaves = light->vpls,
        .leaf_side = light->grid_side,
        .face_count = light->setup.face_count,
        .root_side = bd_plan_tree_root_side(frame->plan, &light->setup, light->grid_side),
        .light = &light->setup,
        .space = &frame->scene->space,
    };
    return bd_vpl_tree_run(&frame->context, &inputs, &light->tree, frame->detail);
}

struct bd_light_uniform *bd_stage_punctuals(const struct bd_frame *frame)
{
    const struct bd_subject *subject = &frame->subject;
    struct bd_light_uniform *punctuals = calloc(subject->light_count + 1, sizeof *punctuals);
    BD_ASSERT(punctuals);
    for (uint32_t i = 0; i < subject->light_count; i++)
        punctuals[i] = bd_light_setup_uniform(&subject->lights[i].setup, &frame->scene->space, 0);
    return punctuals;
}

enum bd_err bd_run_lamps(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    bd_slicer_work(frame->context.slicer, "emitters");
    return bd_punctual_tree_create(bd_stage_punctuals(frame), frame->subject.light_count,
                                   bd_slicer_pause, frame->context.slicer, &frame->lamps,
                                   frame->detail);
}

// On the way to a place that is seen, or to one that a final gather's rays meet.
static uint32_t reflections_of(const struct bd_plan *plan)
{
    if (!plan->final_gather || bd_plan_reads(plan, BD_PARAM_CLAMP)) return plan->bounces - 1;
    return plan->bounces > 2 ? plan->bounces - 2 : 0;
}

// Per render unit squared; 0: by how far virtual lights are apart.
static float clamp_of(const struct bd_frame *frame)
{
    const double per_m = frame->scene->space.render_per_m;
    const double clamp = frame->plan->params.clamp_per_m2 / (per_m * per_m);
    return clamp > 0 ? (float)fmax(fmin(clamp, BD_VPL_CLAMP_MAX), BD_VPL_CLAMP_MIN) : 0;
}

enum bd_err bd_run_light_paths(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_plan *plan = frame->plan;
    struct bd_light_uniform *punctuals = bd_stage_punctuals(frame);
    const struct bd_light_paths_inputs inputs = {
        .scene = frame->scene,
        .snapshot = frame->snapshot,
        .lights = frame->emitters,
        .punctuals = punctuals,
        .punctual_count = frame->subject.light_count,
        .punctuals_fall = plan->punctuals_by_rays && !plan->final_gather,
        .reflections = reflections_of(plan),
        .visibility = bd_stage_light_visibility(frame),
        .count = bd_plan_light_path_count(plan),
        .walk_vpls = plan->final_gather ? plan->params.walk_vpls : 0,
        .punctual_vpls = plan->light_count > 0 ? bd_plan_photon_vpl_count(plan) : 0,
        .emitter_vpls = plan->emitters ? bd_plan_photon_vpl_count(plan) : 0,
        .clamped = bd_plan_reads(plan, BD_PARAM_CLAMP),
        .clamp = clamp_of(frame),
        .seed = frame->subject.seed,
        .kernel = (enum bd_vpl_kernel)plan->params.vpl_kernel,
        .near_field = plan->params.near_field,
        .sends = plan->params.lambert                  ? BD_SENDS_LAMBERT
                 : plan->goes_on && plan->final_gather ? BD_SENDS_BESIDE_INTERFACES
                 : plan->final_gather                  ? BD_SENDS_ALL
                 : plan->panes                         ? BD_SENDS_DIFFUSE_BESIDE_GLASS
                                                       : BD_SENDS_DIFFUSE,
        .glass = plan->final_gather ? plan->goes_on : plan->panes,
        .photons = plan->caustics ? plan->params.photons : 0,
        .root_side = bd_plan_light_path_root_side(plan),
    };
    const enum bd_err err =
        bd_light_paths_run(&frame->context, &inputs, &frame->light_paths, frame->detail);
    free(punctuals);
    return err;
}

enum bd_err bd_run_env_maps(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_params *params = &frame->plan->params;
    const struct bd_processor processor = {bd_renderer_pool(frame->renderer), NULL};
    struct bd_pass_context context = frame->context;
    const struct bd_env_maps_inputs inputs = {
        .scene = frame->scene,
        .snapshot = frame->snapshot,
        .tracer = bd_stage_tracer(frame, bd_env_map_texels(params->env_map_size)),
        .choice_tracer = bd_stage_tracer(frame, BD_ENV_CHOICE_TEXELS),
        .count = params->env_maps,
        .solids = frame->plan->glass,
        .side_px = params->env_map_size,
    };
    context.processor = &processor;
    return bd_env_maps_run(&context, &inputs, &frame->env_maps, frame->detail);
}

enum bd_err bd_run_photons(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_plan *plan = frame->plan;
    struct bd_light_uniform *punctuals = bd_stage_punctuals(frame);
    const struct bd_env_view images = {frame->env_maps, plan->params.paper_mode};
    const struct bd_photons_inputs inputs = {
        .scene = frame->scene,
        .snapshot = frame->snapshot,
        .visibility = bd_stage_light_visibility(frame),
        .punctuals = punctuals,
        .punctual_count = frame->subject.light_count,
        .lights = frame->emitters,
        .count = plan->params.photons,
        .reflections = plan->bounces,
        .lambert = plan->params.lambert,
        .glass = plan->goes_on,
        .caustics = plan->caustics,
        .radius_m = plan->params.photon_radius_m,
        .images = frame->env_maps ? &images : NULL,
        .seed = frame->subject.seed,
    };
    const enum bd_err err =
        bd_photons_run(&frame->context, &inputs, &frame->photons, frame->detail);
    free(punctuals);
    return err;
}

enum bd_err bd_run_points(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_plan *plan = frame->plan;
    const struct bd_params *params = &plan->params;
    struct bd_light_uniform *punctuals = bd_stage_punctuals(frame);
    const struct bd_render_space *space = &frame->scene->space;
    const struct bd_lit_points_inputs inputs = {
        .space = space,
        .snapshot = frame->snapshot,
        .visibility = bd_stage_light_visibility(frame),
        .first = {.lights = frame->emitters,
                  .punctuals = punctuals,
                  .punctual_count = frame->subject.light_count,
                  .space = space},
        .count = params->points,
        .clusters = params->clusters,
        .cells = params->cache_cells,
        .reflections = plan->bounces,
        .explore = params->explore,
        .projected = params->paper_mode,
        .lambert = params->lambert,
        .glass = plan->goes_on,
        .photons = plan->caustics ? params->photons : 0,
        .seed = frame->subject.seed,
    };
    const enum bd_err err =
        bd_lit_points_run(&frame->context, &inputs, &frame->points, frame->detail);
    free(punctuals);
    return err;
}

// Lights that have lists of their own.
static uint32_t lights_with_lists(const struct bd_frame *frame)
{
    const uint32_t inputs = frame->plan->technique->inputs;
    const bool has_maps = inputs & (BD_INPUT_VPL_GRID | BD_INPUT_VPL_CLUSTERS);
    return has_maps && !frame->plan->punctuals_by_rays ? frame->subject.light_count : 0;
}

uint32_t bd_stage_lists(const struct bd_frame *frame, const struct bd_vpl_list **lists)
{
    const uint32_t lights = lights_with_lists(frame);
    const struct bd_light_paths *paths = frame->light_paths;
    uint32_t count = 0;
    while (count < lights) {
        lists[count] = frame->subject.lights[count].vpls;
        count++;
    }
    if (paths && paths->vpls) lists[count++] = paths->vpls;
    return count;
}

void bd_stage_trees(const struct bd_frame *frame, const struct bd_vpl_tree **trees)
{
    const uint32_t lights = lights_with_lists(frame);
    for (uint32_t i = 0; i < lights; i++) trees[i] = frame->subject.lights[i].tree;
    if (frame->light_paths) trees[lights] = frame->light_paths->tree;
}

uint32_t bd_stage_lists_most(const struct bd_frame *frame)
{
    return lights_with_lists(frame) + 1;
}

enum bd_err bd_run_vpl_order(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_vpl_list **lists = calloc(bd_stage_lists_most(frame), sizeof *lists);
    BD_ASSERT(lists);
    const uint32_t count = bd_stage_lists(frame, lists);
    const struct bd_vpl_order_how how = {.radius = (float)frame->scene->space.radius};
    enum bd_err err =
        bd_vpl_order_run(&frame->context, lists, count, &how, &frame->order, frame->detail);
    free(lists);
    return err;
}

// --- what hides them --------------------------------------------------------------------------

uint32_t bd_stage_gathered_lists(const struct bd_frame *frame, const struct bd_vpl_list **lists)
{
    const struct bd_light_paths *paths = frame->light_paths;
    if (frame->plan->final_gather)
        lists[0] = paths->clamped ? paths->clamped : paths->first;
    else if (bd_plan_gathers_in_order(frame->plan))
        lists[0] = frame->order;
    else
        return bd_stage_lists(frame, lists);
    return 1;
}

enum bd_err bd_run_shadow_points(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_plan *plan = frame->plan;
    const bool looks_through_all = plan->panes && plan->straight == BD_STRAIGHT_ALL;
    return bd_shadow_points_run(&frame->context, frame->snapshot, plan->params.ism_points,
                                (enum bd_rays_alpha)plan->params.alpha_coverage,
                                looks_through_all ? &frame->panes : NULL, &frame->shadow_points,
                                frame->detail);
}

enum bd_err bd_run_imperfect_shadows(struct bd_frame *frame, struct bd_frame_light *light)
{
    (void)light;
    const struct bd_vpl_list **lists = calloc(bd_stage_lists_most(frame), sizeof *lists);
    BD_ASSERT(lists);
    const struct bd_imperfect_shadows_inputs inputs = {
        .points = frame->shadow_points,
        .lists = lists,
        .list_count = bd_stage_gathered_lists(frame, lists),
        .side_px = frame->plan->params.ism_size,
    };
    enum bd_err err = bd_imperfect_shadows_run(&frame->context, &inputs, &frame->imperfect_shadows,
                                               frame->detail);
    free(lists);
    return err;
}
