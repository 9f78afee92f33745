#include "frame/stages.h"

#include <string.h>

#include "frame/stage_parts.h"

void bd_stage_mark(struct bd_frame *frame, const char *pass, enum bd_pass_state state)
{
    struct bd_report *report = frame->report;
    for (uint32_t i = 0; i < report->pass_count; i++) {
        if (strcmp(report->passes[i].name, pass) != 0) continue;
        if (report->passes[i].state != BD_PASS_RAN) report->passes[i].state = state;
        if (state == BD_PASS_RAN && frame->is_camera_side) report->passes[i].sub_frames++;
        return;
    }
}

// --- keys -----------------------------------------------------------------------------------

uint64_t bd_stage_key_dvec3(uint64_t key, bd_dvec3 v)
{
    const double numbers[3] = {v.x, v.y, v.z};
    return bd_key_bytes(key, numbers, sizeof numbers);
}

uint64_t bd_stage_key_geometry(uint64_t key, const struct bd_scene *scene)
{
    const struct bd_aspects *a = &scene->aspects;
    const uint64_t numbers[] = {a->geometry, a->transforms, a->materials};
    return bd_key_bytes(key, numbers, sizeof numbers);
}

uint64_t bd_stage_key_light_power(uint64_t key, const struct bd_light_setup *setup,
                                  const struct bd_render_space *space)
{
    const float numbers[] = {setup->light->color[0], setup->light->color[1], setup->light->color[2],
                             setup->light->intensity, setup->light->range_m};
    key = bd_key_bytes(key, numbers, sizeof numbers);
    return bd_key_bytes(key, &space->unit_cd_m2, sizeof space->unit_cd_m2);
}

uint64_t bd_stage_key_settings(uint64_t key, const struct bd_discontinuity_settings *settings)
{
    const double thresholds[] = {settings->depth_threshold, settings->normal_threshold};
    key = bd_key_bytes(key, thresholds, sizeof thresholds);
    key = bd_key_number(key, (uint64_t)settings->finest_level << 32 | settings->coarsest_side);
    return bd_key_number(
        key, (uint64_t)settings->depth_test << 16 | (uint64_t)settings->normal_test << 8 |
                 (uint64_t)settings->geometric_normals << 24 |
                 (uint64_t)settings->lone_pixels << 25 | (uint64_t)settings->neighbourhood);
}

// --- running a stage ------------------------------------------------------------------------

void bd_stage_begin(struct bd_frame *frame, const char *name)
{
    bd_stage_mark(frame, name, BD_PASS_RAN);
    bd_gpu_pass_begin(frame->context.gpu, name);
}

enum bd_err bd_stage_end(struct bd_frame *frame, enum bd_err err)
{
    bd_gpu_pass_end(frame->context.gpu);
    return err;
}

bool bd_stage_take_over(struct bd_frame *frame, uint64_t key, void **output)
{
    if (frame->anew) bd_memo_forget_older(frame->renderer->memo, key);
    *output = bd_memo_find(frame->renderer->memo, key);
    return *output != NULL;
}

bool bd_stage_reuse(struct bd_frame *frame, const char *name, uint64_t key, void **output)
{
    bool found = bd_stage_take_over(frame, key, output);
    if (found) bd_stage_mark(frame, name, BD_PASS_REUSED);
    return found;
}

// --- the scene ------------------------------------------------------------------------------

static void destroy_scene(void *owner, void *output)
{
    struct bd_gpu_scene *scene = output;
    bd_gpu_scene_destroy(&((struct bd_renderer *)owner)->uploader, &scene);
}

enum bd_err bd_stage_upload(struct bd_frame *frame)
{
    struct bd_renderer *renderer = frame->renderer;
    uint64_t key = bd_stage_key_geometry(bd_key_begin("scene"), frame->snapshot);
    frame->scene = bd_memo_find(renderer->memo, key);
    if (!frame->scene) {
        bd_slicer_work(&renderer->slicer, "upload");
        enum bd_err err =
            bd_gpu_scene_create(&renderer->uploader, frame->snapshot, &frame->scene, frame->fault);
        if (err) return err;
        bd_memo_store(renderer->memo, key, frame->scene, bd_gpu_scene_own_bytes(frame->scene),
                      destroy_scene);
    }
    // The light unit follows the lights, which the uploaded scene does not depend on.
    frame->scene->space.unit_cd_m2 = bd_render_space_of(frame->snapshot).unit_cd_m2;
    return BD_ERR_OK;
}
