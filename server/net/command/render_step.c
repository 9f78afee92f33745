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

static void encode(struct bd_command *command)
{
    const struct bd_frame_encode frame = {.options = &command->options,
                                          .result = bd_job_result(command->job),
                                          .revision = command->revision,
                                          .bytes_max = command->loop->serving->limits.reply_bytes};
    command->err = bd_frame_encode(&frame, &command->encoded, &command->encode_ms, &command->fault);
}

// --- answer ---------------------------------------------------------------------------------

static Bounced__Report *report_message(struct bd_command *command)
{
    const struct bd_report *report = &bd_job_result(command->job)->report;
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

static void answer_frame(struct bd_command *command)
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
    bd_counts_frame(&command->loop->counts, &bd_job_result(command->job)->report);
    if (command->has_frame_key &&
        bd_frame_cache_put(command->commands->frame_cache, command->frame_key, &answer))
        name_frame(command, &answer);
    command->answer = answer;
}

// By a frame that was sent before, of the same state of the scene.
static bool answer_remembered(struct bd_command *command, const struct bd_store_entry *entry)
{
    const Bounced__FrameRequest *request = command->envelope->render->frame;
    if (!command->may_remember || !request || !bd_frame_cache_may_keep(request)) return false;
    struct bd_sched_stats device;
    struct bd_answer answer;
    bd_sched_stats(command->loop->serving->sched, &device);
    if (!device.device_ok) return false;
    bd_frame_cache_key(request, entry, &device, command->frame_key);
    command->has_frame_key = true;
    if (!bd_frame_cache_get(command->commands->frame_cache, command->frame_key, &answer))
        return false;
    command->loop->counts.frames_remembered++;
    name_frame(command, &answer);
    Bounced__ReportTime *time = answer.envelope->render_reply->report->time_ms;
    if (time) BD_SET(time, total, bd_ms_since(command->start_ns));
    command->answer = answer;
    return true;
}

// A frame that its deadline or a cancel stopped: the error carries how far it came.
void bd_command_tell_how_far(struct bd_command *command, struct bd_answer *error)
{
    const bool is_stopped = command->err == BD_ERR_DEADLINE || command->err == BD_ERR_CANCELLED;
    if (is_stopped && command->job && bd_job_result(command->job)->err == command->err)
        error->envelope->error->details->report = report_message(command);
}

// --- submit ---------------------------------------------------------------------------------

// The client's deadline began when its request arrived. It is named as it was asked for, whatever
// is left of it.
static enum bd_err spend_deadline(struct bd_command *command, uint32_t *out_ms)
{
    const struct bd_frame_request *frame = &command->options.frame;
    *out_ms = 0;
    if (frame->deadline_ms == 0) return BD_ERR_OK;
    double spent_ms = bd_ms_since(command->start_ns);
    if (spent_ms >= frame->deadline_ms)
        return bd_fault_set(&command->fault, BD_ERR_DEADLINE, "deadline_ms",
                            "the deadline of %u ms passed while the scene was loaded",
                            frame->deadline_ms);
    *out_ms = (uint32_t)spent_ms;
    return BD_ERR_OK;
}

static void submit(struct bd_command *command)
{
    uint32_t spent_ms;
    command->err = spend_deadline(command, &spent_ms);
    if (command->err) return;
    struct bd_job_request request = {.scene = command->scene,
                                     .frame = command->options.frame,
                                     .spent_ms = spent_ms,
                                     .accepts_cheaper = true,
                                     .improves = true,
                                     .priority = BD_PRIORITY_REQUEST,
                                     .turn = bd_client_turn(command->client),
                                     .done = bd_frame_job_done,
                                     .user = &command->frame_job};
    command->err =
        bd_sched_submit(command->loop->serving->sched, &request, &command->job, &command->fault);
}

// --- the steps ------------------------------------------------------------------------------

static const struct bd_step answer_steps[] = {BD_STEP(LOOP, answer_frame), BD_STEPS_END};

static void look_at_frame(struct bd_command *command)
{
    if (command->options.frame.plan_only || !command->options.wants_image)
        bd_command_branch(command, answer_steps);
}

static const struct bd_step frame_steps[] = {
    BD_STEP_TOLD(RENDER, submit, "queue"),
    BD_STEP(LOOP, look_at_frame),
    BD_STEP_TOLD(POOL, encode, "encode"),
    BD_STEP(LOOP, answer_frame),
    BD_STEPS_END,
};

static void begin_frame(struct bd_command *command)
{
    bd_command_branch(command, frame_steps);
}

static const struct bd_step file_steps[] = {
    BD_STEP(LOOP, bd_command_check_files),
    BD_STEP_BACKGROUND(bd_command_import, "import", FILES),
    BD_STEP(LOOP, begin_frame),
    BD_STEPS_END,
};

static void render_held(struct bd_command *command)
{
    const Bounced__Render *request = command->envelope->render;
    const struct bd_store_entry *entry = NULL;
    if (request->environment)
        command->err = bd_fault_set(&command->fault, BD_ERR_USAGE, "environment",
                                    "an environment comes with a file; a held scene has its own");
    if (!command->err)
        command->err =
            bd_store_get(command->loop->serving->store, request->scene, &entry, &command->fault);
    if (command->err) return;
    command->scene = bd_scene_retain(entry->scene);
    command->revision = entry->revision;
    if (answer_remembered(command, entry))
        bd_command_finish(command);
    else
        bd_command_branch(command, frame_steps);
}

static void begin(struct bd_command *command)
{
    const Bounced__Render *request = command->envelope->render;
    command->err = bd_frame_options_read(request->frame, &command->options, &command->fault);
    if (command->err) return;
    command->revision = 1;
    if (request->scene)
        render_held(command);
    else
        bd_command_branch(command, file_steps);
}

const struct bd_step bd_steps_render[] = {BD_STEP(LOOP, begin), BD_STEPS_END};
