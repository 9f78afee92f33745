// Which requests there are, and how their steps are run.

#include "net/command/command.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/log.h"
#include "net/access/auth.h"
#include "net/command/command_internal.h"
#include "net/command/command_rights.h"
#include "net/command/edit_work.h"
#include "net/command/frame_cache.h"
#include "net/command/import_cache.h"
#include "net/command/stats.h"
#include "net/loop/release.h"
#include "net/wire/offers.h"
#include "protocol/field_text.h"

static void leave_list(struct bd_command *command)
{
    struct bd_commands *commands = command->commands;
    if (command->previous)
        command->previous->next = command->next;
    else
        commands->list = command->next;
    if (command->next) command->next->previous = command->previous;
    commands->count--;
}

static void free_command(struct bd_command *command)
{
    if (command->counts_as_job) bd_client_end_job(command->client);
    if (command->payload) bd_client_end_edit(command->client, command->payload_bytes);
    leave_list(command);
    bd_answer_finish(&command->answer);
    bounced__envelope__free_unpacked(command->envelope, NULL);
    bd_blob_upload_abort(&command->body.upload);
    if (command->steps.job) bd_job_release(&command->steps.job);
    bd_release_scene(command->steps.loop, &command->scene);
    bd_bytes_finish(&command->encoded.bytes);
    free(command->notes);
    bd_client_release(&command->client);
    bd_edit_work_destroy(&command->edit);
    free(command->payload);
    free(command->text);
    free(command->parts);
    free(command);
}

// --- its steps ------------------------------------------------------------------------------

static enum bd_err run_step(struct bd_steps *steps)
{
    return steps->step->run.command((struct bd_command *)steps);
}

static void tell_stage(struct bd_steps *steps, const char *stage)
{
    struct bd_command *command = (struct bd_command *)steps;
    if (command->events->progress && !command->abandoned)
        command->events->progress(command->user, stage, -1);
}

static bool is_past_cancel(const struct bd_steps *steps)
{
    const struct bd_command *command = (const struct bd_command *)steps;
    return command->place.is_staged || command->place.batch || command->answer.envelope;
}

// With its answer, or its error.
static void end(struct bd_steps *steps)
{
    struct bd_command *command = (struct bd_command *)steps;
    struct bd_answer answer = command->answer;
    command->answer = (struct bd_answer){0};
    if (steps->detail.err) {
        bd_answer_finish(&answer);
        answer = bd_answer_error(&steps->detail);
        bd_command_tell_how_far(command, &answer);
        steps->loop->counts.requests_refused++;
    }
    BD_ASSERT(answer.envelope); // the last step made one
    if (!command->abandoned) command->events->answer(command->user, &answer);
    bd_answer_finish(&answer);
    struct bd_commits *commits = steps->commits;
    const bool was_queued = bd_edit_queue_leave(&command->place);
    free_command(command);
    if (was_queued) bd_edits_go_on(commits); // what it had of limits is given back
}

static const struct bd_steps_kind kind = {
    .run = run_step, .tell = tell_stage, .is_past_cancel = is_past_cancel, .end = end};

void bd_command_tick(const struct bd_commands *commands)
{
    for (struct bd_command *command = commands->list; command; command = command->next) {
        if (!command->steps.job || !command->events->progress || command->abandoned) continue;
        double share = bd_job_progress(command->steps.job);
        if (share > 0 && share < 1)
            command->events->progress(command->user, bd_job_stage(command->steps.job), share);
    }
}

// A command in the queue of edits ends at its own step: the next edit's turn begins with that end.
void bd_command_cancel(struct bd_command *command)
{
    if (command->place.is_queued)
        atomic_store(&command->steps.cancelled, true);
    else
        bd_steps_cancel(&command->steps);
}

struct bd_command *bd_command_next(const struct bd_command *command)
{
    return command->next;
}

void bd_command_abandon(struct bd_command *command)
{
    command->abandoned = true;
    bd_command_cancel(command);
}

// --- the short ones -------------------------------------------------------------------------

static enum bd_err find_blobs(struct bd_command *command)
{
    const Bounced__BlobHave *request = command->envelope->blob_have;
    struct bd_blobs *blobs = bd_grant_blobs(command->steps.loop->serving->blobs, command->grant);
    Bounced__BlobReply *reply = malloc(sizeof *reply);
    BD_ASSERT(reply);
    bounced__blob_reply__init(reply);
    reply->have = calloc(request->n_blobs ? request->n_blobs : 1, sizeof *reply->have);
    BD_ASSERT(reply->have);
    for (size_t i = 0; i < request->n_blobs; i++) {
        const char *blob = request->blobs[i];
        if (strncmp(blob, "sha256:", 7) == 0 && bd_blobs_have(blobs, blob + 7))
            reply->have[reply->n_have++] = bd_answer_text(blob);
    }
    command->answer = bd_answer_of(BOUNCED__ENVELOPE__BODY_BLOB_REPLY, reply);
    return BD_ERR_OK;
}

static enum bd_err list_devices(struct bd_command *command)
{
    const struct bd_serving *serving = command->steps.loop->serving;
    if (serving->list_devices) command->text = serving->list_devices();
    return BD_ERR_OK;
}

static enum bd_err tell_devices(struct bd_command *command)
{
    command->answer = bd_answer_devices(command->steps.loop->serving->sched, command->text);
    return BD_ERR_OK;
}

static enum bd_err tell_stats(struct bd_command *command)
{
    command->answer = bd_answer_stats(command->steps.loop);
    return BD_ERR_OK;
}

static enum bd_err tell_techniques(struct bd_command *command)
{
    command->answer = bd_answer_techniques();
    return BD_ERR_OK;
}

static enum bd_err tell_options(struct bd_command *command)
{
    command->answer = bd_answer_options();
    return BD_ERR_OK;
}

static const struct bd_step blob_have[] = {BD_STEP(pool, find_blobs), BD_STEPS_END};
static const struct bd_step devices[] = {BD_STEP(pool, list_devices), BD_STEP(loop, tell_devices),
                                         BD_STEPS_END};
static const struct bd_step stats[] = {BD_STEP(loop, tell_stats), BD_STEPS_END};
static const struct bd_step techniques[] = {BD_STEP(loop, tell_techniques), BD_STEPS_END};
static const struct bd_step options[] = {BD_STEP(loop, tell_options), BD_STEPS_END};

// --- the table ------------------------------------------------------------------------------

static const struct bd_command_row rows_of_blobs[] = {{BD_BODY(BLOB_HAVE), .steps = blob_have},
                                                      BD_ROWS_END};
static const struct bd_command_row rows_of_server[] = {
    {BD_BODY(DEVICES), .http = "GET /v1/devices", .steps = devices},
    {BD_BODY(STATS), .role = BD_ROLE_ADMIN, .http = "GET /v1/stats", .steps = stats},
    {BD_BODY(TECHNIQUES), .http = "GET /v1/techniques", .steps = techniques},
    {BD_BODY(OPTIONS), .http = "GET /v1/options", .steps = options},
    BD_ROWS_END,
};
static const struct bd_command_row *const families[] = {
    rows_of_blobs,      bd_rows_of_scenes, bd_rows_of_exports, bd_rows_of_batches,
    bd_rows_of_history, bd_rows_of_replay, bd_rows_of_frames,  rows_of_server,
};
#define FAMILY_COUNT (sizeof families / sizeof families[0])

const struct bd_command_row *bd_command_row_at(uint32_t number)
{
    for (size_t f = 0; f < FAMILY_COUNT; f++)
        for (const struct bd_command_row *row = families[f]; row->steps; row++)
            if (number-- == 0) return row;
    return NULL;
}

const struct bd_command_row *bd_command_row_of(Bounced__Envelope__BodyCase body)
{
    const struct bd_command_row *row;
    for (uint32_t i = 0; (row = bd_command_row_at(i)); i++)
        if (row->body == body) return row;
    return NULL;
}

const ProtobufCMessageDescriptor *bd_command_message(const struct bd_command_row *row)
{
    const ProtobufCFieldDescriptor *field = protobuf_c_message_descriptor_get_field(
        &bounced__envelope__descriptor, (unsigned)row->body);
    BD_ASSERT(field);
    return field->descriptor;
}

// All members of the oneof are messages and lie in one place.
const char *bd_command_text(const struct bd_command *command, const char *field)
{
    const ProtobufCMessage *message = &command->envelope->error->base;
    const ProtobufCFieldDescriptor *found =
        protobuf_c_message_descriptor_get_field_by_name(message->descriptor, field);
    if (!found || found->type != PROTOBUF_C_TYPE_STRING) return NULL;
    return *(char *const *)bd_field_value(message, found);
}

// --- all of them ------------------------------------------------------------------------------

void bd_commands_begin(struct bd_commands *commands, struct bd_commits *commits,
                       const char *import_program)
{
    const struct bd_limits *limits = &commits->loop->serving->limits;
    *commands = (struct bd_commands){
        .loop = commits->loop,
        .live = commits->live,
        .commits = commits,
        .import_cache = bd_import_cache_create(),
        .frame_cache = bd_frame_cache_create(limits),
        // As many as there may be at work at once.
        .import_pool = bd_import_pool_create(import_program, (uint32_t)limits->imports_at_once),
    };
}

void bd_commands_finish(struct bd_commands *commands)
{
    bd_import_pool_destroy(&commands->import_pool);
    bd_import_cache_destroy(&commands->import_cache);
    bd_frame_cache_destroy(&commands->frame_cache);
}

// --- start ----------------------------------------------------------------------------------

// Other requests' payloads mean nothing.
static enum bd_err keep_payload(struct bd_command *command, const struct bd_command_start *start)
{
    if (!command->row->has_payload) return BD_ERR_OK;
    enum bd_err err = bd_client_begin_edit(start->commands->loop->clients, command->client,
                                           start->payload_bytes, &command->steps.detail);
    if (err) return err;
    command->payload_bytes = start->payload_bytes;
    command->payload = malloc(start->payload_bytes + 1);
    BD_ASSERT(command->payload);
    if (start->payload_bytes) memcpy(command->payload, start->payload, start->payload_bytes);
    return BD_ERR_OK;
}

static enum bd_err admit(struct bd_command *command, const struct bd_command_start *start)
{
    enum bd_err err = BD_ERR_OK;
    if (command->steps.loop->draining)
        err = bd_err_set(&command->steps.detail, BD_ERR_BUSY, "", "the server is shutting down");
    if (!err && !command->row)
        err = bd_err_set(&command->steps.detail, BD_ERR_UNSUPPORTED, "body",
                         "this server knows no such request");
    if (!err) err = bd_command_check_rights(command, &command->steps.detail);
    if (!err && bd_command_is_job(command)) {
        err = bd_client_begin_job(command->steps.loop->clients, command->client,
                                  &command->steps.detail);
        command->counts_as_job = !err;
    }
    return err ? err : keep_payload(command, start);
}

// Remembers whether the command ended while it was being started: its memory is gone then.
struct start_watch {
    const struct bd_command_events *events;
    void *user;
    bool ended;
};

static void watched_answer(void *user, struct bd_answer *answer)
{
    struct start_watch *watch = user;
    watch->ended = true;
    watch->events->answer(watch->user, answer);
}

static void watched_progress(void *user, const char *stage, double share)
{
    struct start_watch *watch = user;
    if (watch->events->progress) watch->events->progress(watch->user, stage, share);
}

struct bd_command *bd_command_start(const struct bd_command_start *start)
{
    static const struct bd_command_events watched = {watched_answer, watched_progress};
    struct start_watch watch = {.events = start->events, .user = start->user};
    struct bd_command *command = calloc(1, sizeof *command);
    BD_ASSERT(command);
    *command = (struct bd_command){.commands = start->commands,
                                   .steps = {.kind = &kind,
                                             .loop = start->commands->loop,
                                             .commits = start->commands->commits,
                                             .live = start->commands->live,
                                             .place = &command->place},
                                   .place = {.steps = &command->steps},
                                   .client = start->client,
                                   .grant = start->grant,
                                   .envelope = start->envelope,
                                   .row = bd_command_row_of(start->envelope->body_case),
                                   .events = &watched,
                                   .user = &watch,
                                   .may_remember = start->may_remember,
                                   .next = start->commands->list,
                                   .start_ns = bd_clock_ns()};
    if (start->body) command->body = *start->body;
    bd_client_retain(command->client);
    if (command->next) command->next->previous = command;
    start->commands->list = command;
    start->commands->count++;

    bd_steps_record(&command->steps, admit(command, start));
    bd_steps_begin(&command->steps, command->row ? command->row->steps : NULL);
    if (watch.ended) return NULL;
    command->events = start->events;
    command->user = start->user;
    return command;
}
