// What is made for each sub-frame: of what the camera sees.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "frame/stage_parts.h"
#include "frame/stages.h"
#include "pass/upsample.h"
#include "technique/sub_frame_light.h"

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

static uint64_t key_viewpoint(uint64_t key, const struct bd_viewpoint *v)
{
    const double numbers[] = {v->half_width, v->half_height, v->near_m,
                              v->far_m,      v->sample_x_px, v->sample_y_px};
    key = bd_stage_key_dvec3(key, v->position_m);
    key = bd_stage_key_dvec3(key, v->axis_x);
    key = bd_stage_key_dvec3(key, v->axis_y);
    key = bd_stage_key_dvec3(key, v->axis_z);
    key = bd_key_bytes(key, numbers, sizeof numbers);
    key = bd_key_number(key, v->orthographic);
    return bd_key_number(key, (uint64_t)v->width_px << 32 | v->height_px);
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
    uint64_t key = bd_stage_key_geometry(bd_key_begin("gbuffer"), frame->snapshot);
    key = key_viewpoint(key, &frame->viewpoint);
    key = bd_key_number(key, (uint64_t)plan->params.lambert << 1 | plan->emission);
    // Emission is stored in the frame's light unit.
    if (plan->emission) key = bd_key_bytes(key, &frame->scene->space.unit_cd_m2, sizeof(double));
    frame->gbuffer_key = key;
    if (bd_stage_reuse(frame, "gbuffer", key, (void **)&frame->gbuffer)) return BD_ERR_OK;
    bd_stage_begin(frame, "gbuffer");
    enum bd_err err = bd_stage_end(
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
        key = bd_stage_key_light_power(key, &frame->lights[i].setup, &frame->scene->space);
    }
    frame->direct_key = key;
    if (bd_stage_reuse(frame, "direct", key, (void **)&frame->direct)) return BD_ERR_OK;
    bd_stage_begin(frame, "direct");
    enum bd_err err = bd_stage_end(frame, run_direct(frame));
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
    key = bd_stage_key_settings(key, &inputs.settings);
    frame->discontinuity_key = key;
    if (bd_stage_reuse(frame, "discontinuity", key, (void **)&frame->discontinuity))
        return BD_ERR_OK;
    bd_stage_begin(frame, "discontinuity");
    enum bd_err err = bd_stage_end(
        frame, bd_discontinuity_run(&frame->context, &inputs, &frame->discontinuity, frame->fault));
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
    if (bd_stage_reuse(frame, "fragments", key, (void **)&frame->fragments)) return BD_ERR_OK;
    bd_stage_begin(frame, "fragments");
    enum bd_err err = bd_stage_end(
        frame, bd_fragments_run(&frame->context, &inputs, frame->discontinuity,
                                BD_REFINEMENT_ONE_PASS, &frame->fragments, frame->fault));
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
    if (bd_stage_reuse(frame, "surfaces", key, (void **)&frame->surfaces)) return BD_ERR_OK;
    bd_stage_begin(frame, "surfaces");
    enum bd_err err =
        bd_stage_end(frame, bd_surfaces_run(&frame->context, &inputs, frame->discontinuity,
                                            &frame->surfaces, frame->fault));
    if (err) return err;
    bd_memo_store(frame->renderer->memo, key, frame->surfaces, bd_surfaces_bytes(frame->surfaces),
                  destroy_surfaces);
    return BD_ERR_OK;
}

// Calls `run` with what a technique is given of the frame.
static enum bd_err with_inputs(struct bd_frame *frame,
                               enum bd_err (*run)(struct bd_frame *frame,
                                                  const struct bd_technique_inputs *inputs))
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
        .normal_maps = frame->plan->normal_maps,
    };
    enum bd_err err = run(frame, &inputs);
    free(lists);
    free(trees);
    return err;
}

// The technique brackets its own passes: it alone knows which it runs.
static enum bd_err run_indirect(struct bd_frame *frame, const struct bd_technique_inputs *inputs)
{
    return frame->plan->technique->indirect(&frame->context, inputs, &frame->indirect,
                                            frame->fault);
}

static enum bd_err run_shared(struct bd_frame *frame, const struct bd_technique_inputs *inputs)
{
    const struct bd_first_sub_frame first = {&frame->first.viewpoint, frame->first.gbuffer,
                                             frame->first.indirect};
    return bd_sub_frame_light(&frame->context, frame->plan->technique, inputs, &first,
                              &frame->indirect, frame->fault);
}

static uint64_t key_indirect(const struct bd_frame *frame, const char *of)
{
    const struct bd_technique *technique = frame->plan->technique;
    uint64_t key = bd_key_number(bd_key_begin(of), frame->gbuffer_key);
    struct bd_param_list params;
    bd_params_write(&frame->plan->params, technique, &params);
    for (uint32_t i = 0; i < params.count; i++)
        key = bd_key_bytes(key, params.pairs[i].value, strlen(params.pairs[i].value));
    for (uint32_t i = 0; i < frame->light_count; i++)
        key = bd_key_number(key, frame->lights[i].vpl_key);
    return bd_key_number(key, frame->plan->glossy);
}

static void keep_indirect(struct bd_frame *frame)
{
    bd_memo_store(frame->renderer->memo, frame->indirect_key, frame->indirect,
                  bd_indirect_bytes(frame->indirect), destroy_indirect);
}

enum bd_err bd_stage_indirect(struct bd_frame *frame)
{
    const struct bd_technique *technique = frame->plan->technique;
    frame->indirect_key = key_indirect(frame, technique->name);
    bool reused = bd_stage_take_over(frame, frame->indirect_key, (void **)&frame->indirect);
    for (const char *const *pass = technique->passes; *pass; pass++)
        bd_stage_mark(frame, *pass, reused ? BD_PASS_REUSED : BD_PASS_RAN);
    if (reused) return BD_ERR_OK;
    enum bd_err err = with_inputs(frame, run_indirect);
    if (!err) keep_indirect(frame);
    return err;
}

enum bd_err bd_stage_shared_indirect(struct bd_frame *frame)
{
    const struct bd_technique *technique = frame->plan->technique;
    frame->indirect_key =
        bd_key_bytes(key_indirect(frame, "share"), technique->name, strlen(technique->name));
    bd_stage_mark(frame, "share", BD_PASS_RAN);
    enum bd_err err = with_inputs(frame, run_shared);
    if (err) return err;
    if (frame->indirect->fragment_count > 0)
        bd_stage_mark(frame, technique->passes[0], BD_PASS_RAN);
    const char *const *glossy = frame->plan->glossy ? technique->glossy_passes : NULL;
    for (; glossy && *glossy; glossy++) bd_stage_mark(frame, *glossy, BD_PASS_RAN);
    keep_indirect(frame);
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
    bd_stage_leave_camera_side(frame);
}

void bd_stage_leave_camera_side(struct bd_frame *frame)
{
    frame->gbuffer_key = frame->direct_key = frame->discontinuity_key = 0;
    frame->fragments_key = frame->surfaces_key = frame->indirect_key = 0;
    frame->gbuffer = NULL;
    frame->direct = NULL;
    frame->discontinuity = NULL;
    frame->fragments = NULL;
    frame->surfaces = NULL;
    frame->indirect = NULL;
}

// --- sums over sub-frames -------------------------------------------------------------------

static void destroy_sums(void *owner, void *output)
{
    struct bd_frame_sums *sums = output;
    for (uint32_t l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
        bd_tex_destroy(((struct bd_renderer *)owner)->gpu, &sums->layers[l]);
    free(sums);
}

static uint64_t sums_bytes(const struct bd_frame_sums *sums)
{
    uint64_t bytes = 0;
    for (uint32_t l = 0; l < BD_LAYER_RENDERED_COUNT; l++)
        if (sums->layers[l]) bytes += bd_tex_bytes(sums->layers[l]);
    return bytes;
}

// The layers asked for, and the first sub-frame, of which the others follow. Not how many.
static uint64_t key_sums(const struct bd_frame *frame)
{
    uint64_t key = bd_key_number(bd_key_begin("sums"), frame->gbuffer_key);
    key = bd_key_number(key, frame->direct_key);
    key = bd_key_number(key, frame->plan->indirect ? frame->indirect_key : 0);
    return bd_key_number(key, frame->plan->layers | 1u << BD_LAYER_BEAUTY);
}

static enum bd_err create_sums(struct bd_frame *frame, struct bd_frame_sums **out)
{
    struct bd_frame_sums *sums = *out = calloc(1, sizeof *sums);
    BD_ASSERT(sums);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t l = 0; !err && l < BD_LAYER_RENDERED_COUNT; l++) {
        const struct bd_tex_desc desc = {
            .name = "sum of sub-frames",
            .format = BD_FORMAT_RGBA32F,
            .width_px = frame->request->width_px,
            .height_px = frame->request->height_px,
        };
        if (l == BD_LAYER_BEAUTY || (frame->plan->layers >> l & 1))
            err = bd_tex_create(frame->context.gpu, &desc, &sums->layers[l], frame->fault);
    }
    return err;
}

enum bd_err bd_stage_take_sums(struct bd_frame *frame, struct bd_frame_sums **out)
{
    struct bd_memo *memo = frame->renderer->memo;
    frame->sums_key = key_sums(frame);
    *out = bd_memo_take(memo, frame->sums_key);
    if (*out && ((*out)->count > frame->request->aa || frame->anew)) {
        destroy_sums(frame->renderer, *out);
        *out = NULL;
    }
    return *out ? BD_ERR_OK : create_sums(frame, out);
}

void bd_stage_keep_sums(struct bd_frame *frame, struct bd_frame_sums **sums, bool whole)
{
    if (whole)
        bd_memo_store(frame->renderer->memo, frame->sums_key, *sums, sums_bytes(*sums),
                      destroy_sums);
    else
        destroy_sums(frame->renderer, *sums);
    *sums = NULL;
}
