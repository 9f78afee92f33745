#include "frame/stages.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "pass/upsample.h"

void bd_report_mark(struct bd_report *report, const char *pass, enum bd_pass_state state)
{
    for (uint32_t i = 0; i < report->pass_count; i++) {
        if (strcmp(report->passes[i].name, pass) != 0) continue;
        if (report->passes[i].state != BD_PASS_RAN) report->passes[i].state = state;
        return;
    }
}

// --- keys -----------------------------------------------------------------------------------

// Field by field: structs have padding, and padding has no value.
static uint64_t key_dvec3(uint64_t key, bd_dvec3 v)
{
    const double numbers[3] = {v.x, v.y, v.z};
    return bd_key_bytes(key, numbers, sizeof numbers);
}

static uint64_t key_viewpoint(uint64_t key, const struct bd_viewpoint *v)
{
    const double numbers[] = {v->half_width, v->half_height, v->near_m,
                              v->far_m,      v->sample_x_px, v->sample_y_px};
    key = key_dvec3(key, v->position_m);
    key = key_dvec3(key, v->axis_x);
    key = key_dvec3(key, v->axis_y);
    key = key_dvec3(key, v->axis_z);
    key = bd_key_bytes(key, numbers, sizeof numbers);
    key = bd_key_number(key, v->orthographic);
    return bd_key_number(key, (uint64_t)v->width_px << 32 | v->height_px);
}

// Where triangles are and which are there: what every raster pass reads.
static uint64_t key_geometry(uint64_t key, const struct bd_scene *scene)
{
    const struct bd_aspects *a = &scene->aspects;
    const uint64_t numbers[] = {a->geometry, a->transforms, a->materials};
    return bd_key_bytes(key, numbers, sizeof numbers);
}

// A light's frame and shape, without how bright it is.
static uint64_t key_light_shape(uint64_t key, const struct bd_light_setup *setup)
{
    const double numbers[] = {setup->half_width, setup->half_height, setup->depth_m,
                              setup->light->cone_inner, setup->light->cone_outer};
    key = key_dvec3(key, setup->placement.position);
    key = key_dvec3(key, setup->placement.axis_x);
    key = key_dvec3(key, setup->placement.axis_y);
    key = key_dvec3(key, setup->placement.axis_z);
    key = bd_key_bytes(key, numbers, sizeof numbers);
    return bd_key_number(key, (uint64_t)setup->light->kind << 8 | setup->face_count);
}

static uint64_t key_light_power(uint64_t key, const struct bd_light_setup *setup,
                                const struct bd_render_space *space)
{
    const float numbers[] = {setup->light->color[0], setup->light->color[1],
                             setup->light->color[2], setup->light->intensity,
                             setup->light->range_m};
    key = bd_key_bytes(key, numbers, sizeof numbers);
    return bd_key_bytes(key, &space->unit_cd_m2, sizeof space->unit_cd_m2);
}

static uint64_t key_settings(uint64_t key, const struct bd_discontinuity_settings *settings)
{
    const double thresholds[] = {settings->depth_threshold, settings->normal_threshold};
    key = bd_key_bytes(key, thresholds, sizeof thresholds);
    key = bd_key_number(key, (uint64_t)settings->finest_level << 32 | settings->coarsest_side);
    return bd_key_number(key, (uint64_t)settings->depth_test << 16 |
                                  (uint64_t)settings->normal_test << 8 |
                                  (uint64_t)settings->geometric_normals << 24 |
                                  (uint64_t)settings->lone_pixels << 25 |
                                  (uint64_t)settings->neighbourhood);
}

// --- running a stage ------------------------------------------------------------------------

static void begin_pass(struct bd_frame *frame, const char *name)
{
    bd_report_mark(frame->report, name, BD_PASS_RAN);
    bd_gpu_pass_begin(frame->context.gpu, name);
}

static enum bd_err end_pass(struct bd_frame *frame, enum bd_err err)
{
    bd_gpu_pass_end(frame->context.gpu);
    return err;
}

static bool take_over(struct bd_frame *frame, uint64_t key, void **output)
{
    if (frame->anew) bd_memo_forget_older(frame->renderer->memo, key);
    *output = bd_memo_find(frame->renderer->memo, key);
    return *output != NULL;
}

static bool reuse(struct bd_frame *frame, const char *name, uint64_t key, void **output)
{
    bool found = take_over(frame, key, output);
    if (found) bd_report_mark(frame->report, name, BD_PASS_REUSED);
    return found;
}

static void destroy_scene(void *owner, void *output)
{
    struct bd_gpu_scene *scene = output;
    bd_gpu_scene_destroy(&((struct bd_renderer *)owner)->uploader, &scene);
}

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

static void destroy_gbuffer(void *owner, void *output)
{
    struct bd_gbuffer *gbuffer = output;
    bd_gbuffer_destroy(((struct bd_renderer *)owner)->gpu, &gbuffer);
}

static void destroy_tex(void *owner, void *output)
{
    struct bd_tex *tex = output;
    bd_tex_destroy(((struct bd_renderer *)owner)->gpu, &tex);
}

static void destroy_discontinuity(void *owner, void *output)
{
    struct bd_discontinuity *discontinuity = output;
    bd_discontinuity_destroy(((struct bd_renderer *)owner)->gpu, &discontinuity);
}

static void destroy_fragments(void *owner, void *output)
{
    struct bd_fragments *fragments = output;
    bd_fragments_destroy(((struct bd_renderer *)owner)->gpu, &fragments);
}

static void destroy_surfaces(void *owner, void *output)
{
    struct bd_surfaces *surfaces = output;
    bd_surfaces_destroy(((struct bd_renderer *)owner)->gpu, &surfaces);
}

static void destroy_indirect(void *owner, void *output)
{
    struct bd_indirect *indirect = output;
    bd_indirect_destroy(((struct bd_renderer *)owner)->gpu, &indirect);
}

// --- the stages -----------------------------------------------------------------------------

enum bd_err bd_stage_upload(struct bd_frame *frame)
{
    struct bd_renderer *renderer = frame->renderer;
    uint64_t key = key_geometry(bd_key_begin("scene"), frame->snapshot);
    frame->scene = bd_memo_find(renderer->memo, key);
    if (!frame->scene) {
        enum bd_err err = bd_gpu_scene_create(&renderer->uploader, frame->snapshot, &frame->scene,
                                              frame->fault);
        if (err) return err;
        // Its meshes and textures are shared and counted by the device; what it owns is triangles.
        bd_memo_store(renderer->memo, key, frame->scene,
                      bd_buf_size_bytes(frame->scene->triangles), destroy_scene);
    }
    // The light unit follows the lights, which the uploaded scene does not depend on.
    frame->scene->space.unit_cd_m2 = bd_render_space_of(frame->snapshot).unit_cd_m2;
    return BD_ERR_OK;
}

enum bd_err bd_stage_shadow_map(struct bd_frame *frame, struct bd_frame_light *light)
{
    uint32_t side = frame->plan->params.shadow_size;
    uint64_t key = key_geometry(bd_key_begin("shadow_map"), frame->snapshot);
    light->shadow_key = bd_key_number(key_light_shape(key, &light->setup), side);
    if (reuse(frame, "shadow_map", light->shadow_key, (void **)&light->shadow_map))
        return BD_ERR_OK;
    begin_pass(frame, "shadow_map");
    enum bd_err err =
        end_pass(frame, bd_shadow_map_render(&frame->context, frame->scene, &light->setup, side,
                                             &light->shadow_map, frame->fault));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, light->shadow_key, light->shadow_map,
                  bd_shadow_map_bytes(light->shadow_map), destroy_shadow_map);
    return BD_ERR_OK;
}

enum bd_err bd_stage_rsm(struct bd_frame *frame, struct bd_frame_light *light)
{
    const struct bd_params *params = &frame->plan->params;
    const struct bd_rsm_inputs inputs = {
        .scene = frame->scene,
        .light = &light->setup,
        .side_px = light->rsm_size,
        .lambert = params->lambert,
        .paper_mode = params->paper_mode,
    };
    uint64_t key = key_geometry(bd_key_begin("rsm"), frame->snapshot);
    key = key_light_shape(key, &light->setup);
    key = bd_key_number(key, inputs.side_px);
    light->rsm_key = bd_key_number(key, (uint64_t)params->lambert << 1 | params->paper_mode);
    if (reuse(frame, "rsm", light->rsm_key, (void **)&light->rsm)) return BD_ERR_OK;
    begin_pass(frame, "rsm");
    enum bd_err err = end_pass(
        frame, bd_rsm_render(&frame->context, &inputs, &light->rsm, frame->fault));
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
    key = key_light_power(key, &light->setup, &frame->scene->space);
    key = bd_key_number(key, (uint64_t)inputs.grid_side << 8 | (uint64_t)inputs.kernel);
    light->vpl_key = bd_key_bytes(key, &inputs.near_field, sizeof inputs.near_field);
    if (reuse(frame, "vpl_grid", light->vpl_key, (void **)&light->vpls)) return BD_ERR_OK;
    begin_pass(frame, "vpl_grid");
    enum bd_err err = end_pass(
        frame, bd_vpl_grid_run(&frame->context, &inputs, &light->vpls, frame->fault));
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
    key = key_light_power(key, &light->setup, &frame->scene->space);
    key = key_settings(key, &inputs.settings);
    key = bd_key_number(key, (uint64_t)inputs.finest_block_texels << 8 | (uint64_t)inputs.kernel);
    light->vpl_key = bd_key_bytes(key, &inputs.near_field, sizeof inputs.near_field);
    if (reuse(frame, "vpl_clusters", light->vpl_key, (void **)&light->vpls)) return BD_ERR_OK;
    begin_pass(frame, "vpl_clusters");
    enum bd_err err = end_pass(
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
    if (reuse(frame, "vpl_tree", key, (void **)&light->tree)) return BD_ERR_OK;
    begin_pass(frame, "vpl_tree");
    enum bd_err err = end_pass(
        frame, bd_vpl_tree_run(&frame->context, &inputs, &light->tree, frame->fault));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, key, light->tree, bd_vpl_tree_bytes(light->tree),
                  destroy_tree);
    return BD_ERR_OK;
}

enum bd_err bd_stage_gbuffer(struct bd_frame *frame)
{
    const struct bd_plan *plan = frame->plan;
    const struct bd_gbuffer_inputs inputs = {
        .scene = frame->scene,
        .viewpoint = &frame->viewpoint,
        .lambert = plan->params.lambert,
        .emission = plan->emission,
    };
    uint64_t key = key_geometry(bd_key_begin("gbuffer"), frame->snapshot);
    key = key_viewpoint(key, &frame->viewpoint);
    key = bd_key_number(key, (uint64_t)plan->params.lambert << 1 | plan->emission);
    // Emission is stored in the frame's light unit.
    if (plan->emission)
        key = bd_key_bytes(key, &frame->scene->space.unit_cd_m2, sizeof(double));
    frame->gbuffer_key = key;
    if (reuse(frame, "gbuffer", key, (void **)&frame->gbuffer)) return BD_ERR_OK;
    begin_pass(frame, "gbuffer");
    enum bd_err err = end_pass(
        frame, bd_gbuffer_render(&frame->context, &inputs, &frame->gbuffer, frame->fault));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, key, frame->gbuffer, bd_gbuffer_bytes(frame->gbuffer),
                  destroy_gbuffer);
    return BD_ERR_OK;
}

static enum bd_err run_direct(struct bd_frame *frame)
{
    struct bd_direct_light *lights = calloc(frame->light_count + 1, sizeof *lights);
    BD_ASSERT(lights);
    for (uint32_t i = 0; i < frame->light_count; i++)
        lights[i] = (struct bd_direct_light){&frame->lights[i].setup, frame->lights[i].shadow_map};
    const struct bd_direct_inputs inputs = {
        .scene = frame->scene,
        .viewpoint = &frame->viewpoint,
        .gbuffer = frame->gbuffer,
        .lights = lights,
        .light_count = frame->light_count,
        .lambert = frame->plan->params.lambert,
    };
    enum bd_err err = bd_direct_run(&frame->context, &inputs, &frame->direct, frame->fault);
    free(lights);
    return err;
}

enum bd_err bd_stage_direct(struct bd_frame *frame)
{
    uint64_t key = bd_key_number(bd_key_begin("direct"), frame->gbuffer_key);
    for (uint32_t i = 0; i < frame->light_count; i++) {
        key = bd_key_number(key, frame->lights[i].shadow_key);
        key = key_light_power(key, &frame->lights[i].setup, &frame->scene->space);
    }
    frame->direct_key = key;
    if (reuse(frame, "direct", key, (void **)&frame->direct)) return BD_ERR_OK;
    begin_pass(frame, "direct");
    enum bd_err err = end_pass(frame, run_direct(frame));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, key, frame->direct, bd_tex_bytes(frame->direct),
                  destroy_tex);
    return BD_ERR_OK;
}

static struct bd_discontinuity_inputs discontinuity_inputs(const struct bd_frame *frame)
{
    const struct bd_params *params = &frame->plan->params;
    return (struct bd_discontinuity_inputs){
        .gbuffer = frame->gbuffer,
        .viewpoint = &frame->viewpoint,
        .space = &frame->scene->space,
        .settings =
            {
                .depth_test = (enum bd_depth_test)params->depth_test,
                .normal_test = (enum bd_normal_test)params->normal_test,
                .neighbourhood = (enum bd_neighbourhood)params->neighbourhood,
                .depth_threshold = params->depth_threshold,
                .normal_threshold = params->normal_threshold,
                // What the pixel's own normal adds is put back at every pixel.
                .geometric_normals = params->surface_detail == BD_SURFACE_DETAIL_DIRECTION,
                .coarsest_side = params->coarsest,
                .finest_level = params->finest_level,
                .lone_pixels = true,
            },
    };
}

enum bd_err bd_stage_discontinuity(struct bd_frame *frame)
{
    const struct bd_discontinuity_inputs inputs = discontinuity_inputs(frame);
    uint64_t key = bd_key_number(bd_key_begin("discontinuity"), frame->gbuffer_key);
    key = key_settings(key, &inputs.settings);
    frame->discontinuity_key = key;
    if (reuse(frame, "discontinuity", key, (void **)&frame->discontinuity)) return BD_ERR_OK;
    begin_pass(frame, "discontinuity");
    enum bd_err err = end_pass(frame, bd_discontinuity_run(&frame->context, &inputs,
                                                           &frame->discontinuity, frame->fault));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, key, frame->discontinuity,
                  bd_discontinuity_bytes(frame->discontinuity), destroy_discontinuity);
    return BD_ERR_OK;
}

enum bd_err bd_stage_fragments(struct bd_frame *frame)
{
    const struct bd_discontinuity_inputs inputs = discontinuity_inputs(frame);
    uint64_t key = bd_key_number(bd_key_begin("fragments"), frame->discontinuity_key);
    frame->fragments_key = key;
    if (reuse(frame, "fragments", key, (void **)&frame->fragments)) return BD_ERR_OK;
    begin_pass(frame, "fragments");
    enum bd_err err = end_pass(frame, bd_fragments_run(&frame->context, &inputs,
                                                       frame->discontinuity, BD_REFINEMENT_ONE_PASS,
                                                       &frame->fragments, frame->fault));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, key, frame->fragments,
                  bd_fragments_bytes(frame->fragments), destroy_fragments);
    return BD_ERR_OK;
}

enum bd_err bd_stage_surfaces(struct bd_frame *frame)
{
    const struct bd_discontinuity_inputs inputs = discontinuity_inputs(frame);
    uint64_t key = bd_key_number(bd_key_begin("surfaces"), frame->discontinuity_key);
    frame->surfaces_key = key;
    if (reuse(frame, "surfaces", key, (void **)&frame->surfaces)) return BD_ERR_OK;
    begin_pass(frame, "surfaces");
    enum bd_err err =
        end_pass(frame, bd_surfaces_run(&frame->context, &inputs, frame->discontinuity,
                                        &frame->surfaces, frame->fault));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, key, frame->surfaces, bd_surfaces_bytes(frame->surfaces),
                  destroy_surfaces);
    return BD_ERR_OK;
}

static enum bd_err run_indirect(struct bd_frame *frame)
{
    const struct bd_vpl_list **lists = calloc(frame->light_count + 1, sizeof *lists);
    const struct bd_vpl_tree **trees = calloc(frame->light_count + 1, sizeof *trees);
    BD_ASSERT(lists && trees);
    for (uint32_t i = 0; i < frame->light_count; i++) {
        lists[i] = frame->lights[i].vpls;
        trees[i] = frame->lights[i].tree;
    }
    const struct bd_technique_inputs inputs = {
        .scene = frame->scene,
        .viewpoint = &frame->viewpoint,
        .gbuffer = frame->gbuffer,
        .params = &frame->plan->params,
        .vpl_lists = lists,
        .vpl_trees = trees,
        .light_count = frame->light_count,
        .discontinuity = frame->discontinuity,
        .fragments = frame->fragments,
        .surfaces = frame->surfaces,
        .glossy_receivers = frame->plan->glossy,
    };
    // The technique brackets its own passes: it alone knows which it runs.
    enum bd_err err =
        frame->plan->technique->indirect(&frame->context, &inputs, &frame->indirect, frame->fault);
    free(lists);
    free(trees);
    return err;
}

enum bd_err bd_stage_indirect(struct bd_frame *frame)
{
    const struct bd_technique *technique = frame->plan->technique;
    uint64_t key = bd_key_number(bd_key_begin(technique->name), frame->gbuffer_key);
    struct bd_param_list params;
    bd_params_write(&frame->plan->params, technique, &params);
    for (uint32_t i = 0; i < params.count; i++)
        key = bd_key_bytes(key, params.pairs[i].value, strlen(params.pairs[i].value));
    for (uint32_t i = 0; i < frame->light_count; i++)
        key = bd_key_number(key, frame->lights[i].vpl_key);
    key = bd_key_number(key, frame->plan->glossy);
    frame->indirect_key = key;
    bool reused = take_over(frame, key, (void **)&frame->indirect);
    for (const char *const *pass = technique->passes; *pass; pass++)
        bd_report_mark(frame->report, *pass, reused ? BD_PASS_REUSED : BD_PASS_RAN);
    if (reused) return BD_ERR_OK;
    enum bd_err err = run_indirect(frame);
    if (err) return err;
    bd_memo_store(frame->renderer->memo, key, frame->indirect, bd_indirect_bytes(frame->indirect),
                  destroy_indirect);
    return BD_ERR_OK;
}

void bd_stage_forget_camera_side(struct bd_frame *frame)
{
    bd_memo_forget(frame->renderer->memo, frame->gbuffer_key);
    bd_memo_forget(frame->renderer->memo, frame->direct_key);
    bd_memo_forget(frame->renderer->memo, frame->discontinuity_key);
    bd_memo_forget(frame->renderer->memo, frame->fragments_key);
    bd_memo_forget(frame->renderer->memo, frame->surfaces_key);
    bd_memo_forget(frame->renderer->memo, frame->indirect_key);
    frame->gbuffer = NULL;
    frame->direct = NULL;
    frame->discontinuity = NULL;
    frame->fragments = NULL;
    frame->surfaces = NULL;
    frame->indirect = NULL;
}
