#include "frame/stages.h"

#include <string.h>

#include "base/assert.h"

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

static void mark_passes(struct bd_frame *frame, enum bd_stage stage, enum bd_pass_state state)
{
    const char *names[BD_STAGE_PASSES_MAX];
    const uint32_t count = bd_stage_passes(frame->plan, stage, names);
    for (uint32_t i = 0; i < count; i++) bd_stage_mark(frame, names[i], state);
}

// --- running a stage ------------------------------------------------------------------------

static void *slot(struct bd_frame *frame, struct bd_frame_light *light, size_t output)
{
    return (char *)(light ? (void *)light : (void *)frame) + output;
}

static void *take_over(struct bd_frame *frame, uint64_t key)
{
    if (frame->anew) bd_memo_forget_older(frame->renderer->memo, key);
    return bd_memo_find(frame->renderer->memo, key);
}

static enum bd_err run(struct bd_frame *frame, const struct bd_stage_row *row,
                       struct bd_frame_light *light)
{
    if (row->brackets_itself) return row->run(frame, light);
    bd_gpu_pass_begin(frame->context.gpu, row->pass);
    enum bd_err err = row->run(frame, light);
    bd_gpu_pass_end(frame->context.gpu);
    return err;
}

enum bd_err bd_stage_run(struct bd_frame *frame, enum bd_stage stage, struct bd_frame_light *light)
{
    const struct bd_stage_row *row = &bd_stage_rows[stage];
    if (!bd_plan_has(frame->plan, stage)) return BD_ERR_OK;
    const uint64_t key = bd_stage_key(&frame->subject, stage, light);
    (light ? light->keys : frame->keys)[stage] = key;
    void *output = take_over(frame, key);
    if (output) {
        memcpy(slot(frame, light, row->output), &output, sizeof output);
        mark_passes(frame, stage, BD_PASS_REUSED);
        return BD_ERR_OK;
    }
    mark_passes(frame, stage, BD_PASS_RAN);
    frame->rests_on = 0;
    enum bd_err err = run(frame, row, light);
    if (err) return err;
    memcpy(&output, slot(frame, light, row->output), sizeof output);
    bd_memo_store(frame->renderer->memo, key, output, row->bytes(output), row->destroy);
    if (frame->rests_on) bd_memo_rest_on(frame->renderer->memo, key, frame->rests_on);
    return BD_ERR_OK;
}

// --- the scene ------------------------------------------------------------------------------

static void destroy_scene(void *owner, void *output)
{
    struct bd_gpu_scene *scene = output;
    bd_gpu_scene_destroy(&((struct bd_renderer *)owner)->uploader, &scene);
}

static uint64_t key_scene(const struct bd_scene *scene)
{
    uint64_t key = bd_key_begin("scene");
    for (uint32_t i = 0; i < BD_ASPECT_COUNT; i++)
        if (BD_ASPECTS_SURFACES >> i & 1) key = bd_key_number(key, scene->aspects.counter[i]);
    return key;
}

enum bd_err bd_stage_upload(struct bd_frame *frame)
{
    struct bd_renderer *renderer = frame->renderer;
    const uint64_t key = key_scene(frame->snapshot);
    frame->scene = bd_memo_find(renderer->memo, key);
    if (!frame->scene) {
        bd_slicer_work(&renderer->slicer, "upload");
        enum bd_err err =
            bd_gpu_scene_create(&renderer->uploader, frame->snapshot, &frame->scene, frame->detail);
        if (err) return err;
        bd_memo_store(renderer->memo, key, frame->scene, bd_gpu_scene_own_bytes(frame->scene),
                      destroy_scene);
    }
    // The light unit follows the lights, which the uploaded scene does not depend on.
    frame->scene->space.unit_cd_m2 = bd_render_space_of(frame->snapshot).unit_cd_m2;
    return BD_ERR_OK;
}

// --- rounds of sub-frames -------------------------------------------------------------------

// What depends on no chance is the first round's, too.
static bool is_of_round(const struct bd_frame *frame, enum bd_stage stage)
{
    struct bd_subject first = frame->subject;
    first.seed = frame->request->seed;
    first.round = 0;
    if (frame->keys[stage] == 0) return false;
    return bd_stage_rows[stage].of != BD_STAGE_OF_FRAME ||
           bd_stage_key(&first, stage, NULL) != frame->keys[stage];
}

void bd_stage_note_round(struct bd_frame *frame)
{
    if (frame->subject.round == 0) return;
    for (enum bd_stage stage = 0; stage < BD_STAGE_COUNT; stage++) {
        if (!is_of_round(frame, stage)) continue;
        BD_ASSERT_CMP(frame->round_key_count, <, 2 * BD_STAGE_COUNT);
        frame->round_keys[frame->round_key_count++] = frame->keys[stage];
    }
}

void bd_stage_forget_round(struct bd_frame *frame)
{
    for (uint32_t i = 0; i < frame->round_key_count; i++)
        bd_memo_forget(frame->renderer->memo, frame->round_keys[i]);
    frame->round_key_count = 0;
}
