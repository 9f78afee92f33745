// The steps from a scene to an image: a job on the scheduler, then encoding on the pool.

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/clock.h"
#include "net/command/command_internal.h"
#include "net/command/frame_cache.h"
#include "net/command/stats.h"
#include "net/live/frame_encode.h"

// --- encode ---------------------------------------------------------------------------------

static enum bd_err encode(struct bd_command *command)
{
    const struct bd_frame_encode frame = {.options = &command->options,
                                          .result = bd_job_result(command->steps.job),
                                          .revision = command->revision,
                                          .bytes_max =
                                              command->steps.loop->serving->limits.reply_bytes};
    return bd_frame_encode(&frame, &command->encoded, &command->encode_ms, &command->steps.detail);
}

// --- answer ---------------------------------------------------------------------------------

static Bounced__Report *report_message(struct bd_command *command)
{
    const struct bd_report *report = &bd_job_result(command->steps.job)->report;
    bool has_exposure = command->encoded.bytes.size_bytes > 0;
    return bd_report_message(report, command->revision, command->load_ms, command->encode_ms,
                             has_exposure ? &command->encoded.exposure_stops : NULL);
}

static void name_frame(const struct bd_command *command, struct bd_answer *answer)
{
    char hex[BD_SHA256_HEX];
    bd_sha256_hex(command->frame_key, hex);
    snprintf(answer->etag, sizeof answer->etag, "\"%.64s\"", hex);
}

static enum bd_err answer_frame(struct bd_command *command)
{
    struct bd_encoded *encoded = &command->encoded;
    Bounced__RenderReply *reply = malloc(sizeof *reply);
    BD_ASSERT(reply);
    bounced__render_reply__init(reply);
    reply->report = report_message(command);
    struct bd_answer answer = bd_answer_of(BOUNCED__ENVELOPE__BODY_RENDER_REPLY, reply);
    if (encoded->bytes.size_bytes > 0) {
        enum bd_encode_format format = command->options.encode.format;
        reply->encoding = bd_answer_text(bd_encode_format_name(format));
        answer.payload = encoded->bytes.data;
        answer.payload_bytes = encoded->bytes.size_bytes;
        answer.payload_type = bd_encode_content_type(format);
        encoded->bytes = (struct bd_bytes){0};
    }
    bd_counts_frame(&command->steps.loop->counts, &bd_job_result(command->steps.job)->report);
    if (command->has_frame_key &&
        bd_frame_cache_put(command->commands->frame_cache, command->frame_key, &answer))
        name_frame(command, &answer);
    command->answer = answer;
    return BD_ERR_OK;
}

// By a frame that was sent before, of the same state of the scene.
static bool answer_remembered(struct bd_command *command, const struct bd_store_entry *entry)
{
    const Bounced__FrameRequest *request = command->envelope->render->frame;
    if (!command->may_remember || !request || !bd_frame_cache_may_keep(request)) return false;
    struct bd_sched_stats device;
    struct bd_answer answer;
    bd_sched_stats(command->steps.loop->serving->sched, &device);
    if (!device.device_ok) return false;
    bd_frame_cache_key(request, entry, &device, command->frame_key);
    command->has_frame_key = true;
    if (!bd_frame_cache_get(command->commands->frame_cache, command->frame_key, &answer))
        return false;
    command->steps.loop->counts.frames_remembered++;
    name_frame(command, &answer);
    Bounced__ReportTime *time = answer.envelope->render_reply->report->time_ms;
    if (time) BD_SET(time, total, bd_ms_since(command->start_ns));
    command->answer = answer;
    return true;
}

// A frame that its deadline or a cancel stopped: the error carries how far it came.
void bd_command_tell_how_far(struct bd_command *command, struct bd_answer *error)
{
    const enum bd_err err = command->steps.detail.err;
    const bool is_stopped = err == BD_ERR_DEADLINE || err == BD_ERR_CANCELLED;
    if (is_stopped && command->steps.job && bd_job_result(command->steps.job)->err == err)
        error->envelope->error->details->report = report_message(command);
}

// --- submit ---------------------------------------------------------------------------------

// The client's deadline began when its request arrived. It is named as it was asked for, whatever
// is left of it: a job of which nothing is left ends at once, with its plan for a report.
static uint32_t spent_of_deadline_ms(const struct bd_command *command)
{
    const uint32_t deadline_ms = command->options.frame.deadline_ms;
    const double spent_ms = bd_ms_since(command->start_ns);
    return spent_ms < deadline_ms ? (uint32_t)spent_ms : deadline_ms;
}

static enum bd_err submit(struct bd_command *command)
{
    struct bd_job_request request = {.scene = command->scene,
                                     .frame = command->options.frame,
                                     .spent_ms = spent_of_deadline_ms(command),
                                     .accepts_cheaper = true,
                                     .improves = true,
                                     .priority = BD_PRIORITY_REQUEST,
                                     .turn = bd_client_turn(command->client),
                                     .done = bd_frame_job_done,
                                     .user = &command->steps};
    return bd_sched_submit(command->steps.loop->serving->sched, &request, &command->steps.job,
                           &command->steps.detail);
}

// --- the steps ------------------------------------------------------------------------------

static const struct bd_step answer_steps[] = {BD_STEP(loop, answer_frame), BD_STEPS_END};

static enum bd_err look_at_frame(struct bd_command *command)
{
    if (command->options.frame.plan_only || !command->options.wants_image)
        bd_steps_branch(&command->steps, answer_steps);
    return BD_ERR_OK;
}

static const struct bd_step frame_steps[] = {
    BD_STEP_TOLD(render, submit, "queue"),
    BD_STEP(loop, look_at_frame),
    BD_STEP_TOLD(pool, encode, "encode"),
    BD_STEP(loop, answer_frame),
    BD_STEPS_END,
};

static enum bd_err begin_frame(struct bd_command *command)
{
    bd_steps_branch(&command->steps, frame_steps);
    return BD_ERR_OK;
}

static const struct bd_step file_steps[] = {
    BD_STEP(loop, bd_command_check_files),
    BD_STEP_BACKGROUND(bd_command_import, "import", FILES),
    BD_STEP(loop, begin_frame),
    BD_STEPS_END,
};

static enum bd_err render_held(struct bd_command *command)
{
    const Bounced__Render *request = command->envelope->render;
    const struct bd_store_entry *entry = NULL;
    if (request->environment)
        return bd_err_set(&command->steps.detail, BD_ERR_USAGE, "environment",
                          "an environment comes with a file; a held scene has its own");
    enum bd_err err = bd_store_get(command->steps.loop->serving->store, request->scene, &entry,
                                   &command->steps.detail);
    if (err) return err;
    command->scene = bd_scene_retain(entry->scene);
    command->revision = entry->revision;
    if (answer_remembered(command, entry))
        bd_steps_finish(&command->steps);
    else
        bd_steps_branch(&command->steps, frame_steps);
    return BD_ERR_OK;
}

static enum bd_err begin(struct bd_command *command)
{
    const Bounced__Render *request = command->envelope->render;
    enum bd_err err =
        bd_frame_options_read(request->frame, &command->options, &command->steps.detail);
    if (err) return err;
    command->revision = 1;
    if (request->scene) return render_held(command);
    bd_steps_branch(&command->steps, file_steps);
    return BD_ERR_OK;
}

static const struct bd_step steps[] = {BD_STEP(loop, begin), BD_STEPS_END};

const struct bd_command_row bd_rows_of_frames[] = {
    {BD_BODY(RENDER), BD_OF_SCENE, .is_job = true, .steps = steps},
    BD_ROWS_END,
};
