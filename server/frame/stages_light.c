// What is made for each light, whoever looks.

#include "frame/stage_parts.h"
#include "frame/stages.h"

static void destroy_shadow_map(void *owner, void *output)
{
    struct bd_shadow_map *map = output;
    bd_shadow_map_destroy(((struct bd_renderer *)owner)->gpu, &map);
}

static void destroy_rsm(void *owner, void *output)
{
    struct bd_rsm *rsm = output;
    bd_rsm_destroy(((struct bd_renderer *)owner)->gpu, &rsm);
}

static void release_weights(void *owner, void *output)
{
    struct bd_rsm_weight_map *map = output;
    bd_rsm_weight_map_release(((struct bd_renderer *)owner)->gpu, &map);
}

static void destroy_vpls(void *owner, void *output)
{
    struct bd_vpl_list *list = output;
    bd_vpl_list_destroy(((struct bd_renderer *)owner)->gpu, &list);
}

static void destroy_tree(void *owner, void *output)
{
    struct bd_vpl_tree *tree = output;
    bd_vpl_tree_destroy(((struct bd_renderer *)owner)->gpu, &tree);
}

// A light's frame and shape, without how bright it is.
static uint64_t key_light_shape(uint64_t key, const struct bd_light_setup *setup)
{
    const double numbers[] = {setup->half_width, setup->half_height, setup->depth_m,
                              setup->light->cone_inner, setup->light->cone_outer};
    key = bd_stage_key_dvec3(key, setup->placement.position);
    key = bd_stage_key_dvec3(key, setup->placement.axis_x);
    key = bd_stage_key_dvec3(key, setup->placement.axis_y);
    key = bd_stage_key_dvec3(key, setup->placement.axis_z);
    key = bd_key_bytes(key, numbers, sizeof numbers);
    return bd_key_number(key, (uint64_t)setup->light->kind << 8 | setup->face_count);
}

enum bd_err bd_stage_shadow_map(struct bd_frame *frame, struct bd_frame_light *light)
{
    uint32_t side = frame->plan->params.shadow_size;
    uint64_t key = bd_stage_key_geometry(bd_key_begin("shadow_map"), frame->snapshot);
    light->shadow_key = bd_key_number(key_light_shape(key, &light->setup), side);
    if (bd_stage_reuse(frame, "shadow_map", light->shadow_key, (void **)&light->shadow_map))
        return BD_ERR_OK;
    bd_stage_begin(frame, "shadow_map");
    enum bd_err err =
        bd_stage_end(frame, bd_shadow_map_render(&frame->context, frame->scene, &light->setup, side,
                                                 &light->shadow_map, frame->fault));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, light->shadow_key, light->shadow_map,
                  bd_shadow_map_bytes(light->shadow_map), destroy_shadow_map);
    return BD_ERR_OK;
}

// What a moved light keeps, and one whose scene changes: no pass of its own. Directional weights
// are areas in render units; those of the others have no length in them.
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
        bd_rsm_weight_map_create(&frame->context, inputs, &inputs->weights, frame->fault);
    if (err) return err;
    bd_memo_store(memo, key, inputs->weights, bd_tex_bytes(inputs->weights->tex), release_weights);
    return BD_ERR_OK;
}

enum bd_err bd_stage_rsm(struct bd_frame *frame, struct bd_frame_light *light)
{
    const struct bd_params *params = &frame->plan->params;
    struct bd_rsm_inputs inputs = {
        .scene = frame->scene,
        .light = &light->setup,
        .side_px = light->rsm_size,
        .lambert = params->lambert,
        .paper_mode = params->paper_mode,
    };
    uint64_t key = bd_stage_key_geometry(bd_key_begin("rsm"), frame->snapshot);
    key = key_light_shape(key, &light->setup);
    key = bd_key_number(key, inputs.side_px);
    light->rsm_key = bd_key_number(key, (uint64_t)params->lambert << 1 | params->paper_mode);
    if (bd_stage_reuse(frame, "rsm", light->rsm_key, (void **)&light->rsm)) return BD_ERR_OK;
    bd_stage_begin(frame, "rsm");
    enum bd_err err = find_weights(frame, &inputs);
    if (!err) err = bd_rsm_render(&frame->context, &inputs, &light->rsm, frame->fault);
    err = bd_stage_end(frame, err);
    if (err) return err;
    bd_memo_store(frame->renderer->memo, light->rsm_key, light->rsm, bd_rsm_bytes(light->rsm),
                  destroy_rsm);
    return BD_ERR_OK;
}

enum bd_err bd_stage_vpl_grid(struct bd_frame *frame, struct bd_frame_light *light)
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
    uint64_t key = bd_key_number(bd_key_begin("vpl_grid"), light->rsm_key);
    key = bd_stage_key_light_power(key, &light->setup, &frame->scene->space);
    key = bd_key_number(key, (uint64_t)inputs.grid_side << 8 | (uint64_t)inputs.kernel);
    light->vpl_key = bd_key_bytes(key, &inputs.near_field, sizeof inputs.near_field);
    if (bd_stage_reuse(frame, "vpl_grid", light->vpl_key, (void **)&light->vpls)) return BD_ERR_OK;
    bd_stage_begin(frame, "vpl_grid");
    enum bd_err err =
        bd_stage_end(frame, bd_vpl_grid_run(&frame->context, &inputs, &light->vpls, frame->fault));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, light->vpl_key, light->vpls,
                  bd_vpl_list_bytes(light->vpls), destroy_vpls);
    return BD_ERR_OK;
}

static struct bd_vpl_clusters_inputs clusters_inputs(const struct bd_frame *frame,
                                                     const struct bd_frame_light *light)
{
    const struct bd_params *params = &frame->plan->params;
    const uint32_t side = light->rsm_size;
    const struct bd_multires_layout layout = bd_multires_layout_of(side, side, light->grid_side);
    const uint32_t coarsest = layout.size_px.z - 1;
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
        .finest_block_texels =
            1u << (coarsest > params->cluster_levels ? coarsest - params->cluster_levels : 0),
        .kernel = (enum bd_vpl_kernel)params->vpl_kernel,
        .near_field = params->near_field,
    };
}

enum bd_err bd_stage_vpl_clusters(struct bd_frame *frame, struct bd_frame_light *light)
{
    const struct bd_vpl_clusters_inputs inputs = clusters_inputs(frame, light);
    uint64_t key = bd_key_number(bd_key_begin("vpl_clusters"), light->rsm_key);
    key = bd_stage_key_light_power(key, &light->setup, &frame->scene->space);
    key = bd_stage_key_settings(key, &inputs.settings);
    key = bd_key_number(key, (uint64_t)inputs.finest_block_texels << 8 | (uint64_t)inputs.kernel);
    light->vpl_key = bd_key_bytes(key, &inputs.near_field, sizeof inputs.near_field);
    if (bd_stage_reuse(frame, "vpl_clusters", light->vpl_key, (void **)&light->vpls))
        return BD_ERR_OK;
    bd_stage_begin(frame, "vpl_clusters");
    enum bd_err err = bd_stage_end(
        frame, bd_vpl_clusters_run(&frame->context, &inputs, &light->vpls, frame->fault));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, light->vpl_key, light->vpls,
                  bd_vpl_list_bytes(light->vpls), destroy_vpls);
    return BD_ERR_OK;
}

enum bd_err bd_stage_vpl_tree(struct bd_frame *frame, struct bd_frame_light *light)
{
    const struct bd_vpl_tree_inputs inputs = {
        .leaves = light->vpls,
        .leaf_side = light->grid_side,
        .face_count = light->setup.face_count,
        .root_side = bd_plan_tree_root_side(frame->plan, &light->setup, light->grid_side),
        .light = &light->setup,
        .space = &frame->scene->space,
    };
    uint64_t key = bd_key_number(bd_key_begin("vpl_tree"), light->vpl_key);
    key = bd_key_number(key, inputs.root_side);
    if (bd_stage_reuse(frame, "vpl_tree", key, (void **)&light->tree)) return BD_ERR_OK;
    bd_stage_begin(frame, "vpl_tree");
    enum bd_err err =
        bd_stage_end(frame, bd_vpl_tree_run(&frame->context, &inputs, &light->tree, frame->fault));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, key, light->tree, bd_vpl_tree_bytes(light->tree),
                  destroy_tree);
    return BD_ERR_OK;
}
