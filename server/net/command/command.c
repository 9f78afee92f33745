#include "net/command/command.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/log.h"
#include "net/access/blob_rights.h"
#include "net/command/command_internal.h"
#include "net/command/command_rights.h"
#include "net/command/edit_replay.h"
#include "net/command/edit_step.h"
#include "net/command/edit_work.h"
#include "net/command/export_step.h"
#include "net/command/frame_cache.h"
#include "net/command/import_cache.h"
#include "net/command/scene_change.h"
#include "net/command/scene_step.h"
#include "net/command/stats.h"
#include "net/loop/release.h"
#include "net/wire/device_list.h"
#include "net/wire/option_list.h"
#include "net/wire/technique_list.h"

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
    bounced__envelope__free_unpacked(command->envelope, NULL);
    if (command->blob_reply) bounced__blob_reply__free_unpacked(command->blob_reply, NULL);
    bd_blob_upload_abort(&command->body.upload);
    if (command->job) bd_job_release(&command->job);
    bd_release_scene(command->loop, &command->scene);
    bd_bytes_finish(&command->encoded.bytes);
    free(command->notes);
    bd_client_release(&command->client);
    bd_edit_work_destroy(&command->edit);
    free(command->payload);
    free(command->text);
    free(command->parts);
    free(command);
}

void bd_command_end(struct bd_command *command, struct bd_answer *answer)
{
    if (answer->envelope->body_case == BOUNCED__ENVELOPE__BODY_ERROR)
        command->loop->counts.requests_refused++;
    if (!command->abandoned) command->events->answer(command->user, answer);
    bd_answer_finish(answer);
    free_command(command);
}

void bd_command_end_fault(struct bd_command *command)
{
    struct bd_answer answer = bd_answer_error(&command->fault);
    bd_command_end(command, &answer);
}

void bd_command_pool(struct bd_command *command, uv_work_cb on_pool, uv_after_work_cb back)
{
    command->work.data = command;
    int result = uv_queue_work(&command->loop->uv, &command->work, on_pool, back);
    BD_ASSERT_CMP(result, ==, 0);
}

static void background_begun(struct bd_background *work)
{
    struct bd_command *command = work->user;
    bd_command_progress(command, command->stage);
}

static void background_run(struct bd_background *work)
{
    struct bd_command *command = work->user;
    command->run(command);
}

static void background_back(struct bd_background *work)
{
    struct bd_command *command = work->user;
    command->err = bd_command_check_background(command);
    if (!bd_command_stop_here(command)) command->then(command);
}

void bd_command_background(struct bd_command *command, const char *stage,
                           void (*run)(struct bd_command *command),
                           void (*then)(struct bd_command *command))
{
    command->stage = stage;
    command->run = run;
    command->then = then;
    command->background = (struct bd_background){
        .user = command, .begun = background_begun, .run = background_run, .back = background_back};
    bd_background_start(command->loop, &command->background);
}

enum bd_err bd_command_check_background(struct bd_command *command)
{
    if (!command->background.has_failed) return command->err;
    return bd_fault_set(&command->fault, BD_ERR_NO_MEMORY, "", "the system has no thread for it");
}

bool bd_command_stop_here(struct bd_command *command)
{
    if (atomic_load(&command->cancelled) && !command->err)
        command->err =
            bd_fault_set(&command->fault, BD_ERR_CANCELLED, "", "the request was cancelled");
    if (!command->err) return false;
    bd_command_end_fault(command);
    return true;
}

void bd_command_progress(struct bd_command *command, const char *stage)
{
    if (command->events->progress && !command->abandoned)
        command->events->progress(command->user, stage, -1);
}

void bd_command_tick(const struct bd_commands *commands)
{
    for (struct bd_command *command = commands->list; command; command = command->next) {
        if (!command->job || !command->events->progress || command->abandoned) continue;
        double share = bd_job_progress(command->job);
        if (share > 0 && share < 1)
            command->events->progress(command->user, bd_job_stage(command->job), share);
    }
}

// What waits for its turn has nothing under way that would come back: it ends here. An edit's
// import has its place in the queue of edits, and comes to its own end.
static bool drop_waiting(struct bd_command *command)
{
    if (command->edit || !bd_background_drop(&command->background)) return false;
    bool stopped = bd_command_stop_here(command);
    BD_ASSERT(stopped);
    return true;
}

void bd_command_cancel(struct bd_command *command)
{
    atomic_store(&command->cancelled, true);
    if (drop_waiting(command)) return;
    if (command->job) bd_job_cancel(command->job);
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

static void scene_add_then(struct bd_command *command)
{
    const char *name = command->envelope->scene_add->name;
    bd_command_scene_add(command, name ? name : "");
}

static void blob_have_on_pool(uv_work_t *work)
{
    struct bd_command *command = work->data;
    const Bounced__BlobHave *request = command->envelope->blob_have;
    Bounced__BlobReply *reply = command->blob_reply;
    struct bd_blobs *blobs = bd_grant_blobs(command->loop->serving->blobs, command->grant);
    reply->have = calloc(request->n_blobs ? request->n_blobs : 1, sizeof *reply->have);
    BD_ASSERT(reply->have);
    for (size_t i = 0; i < request->n_blobs; i++) {
        const char *blob = request->blobs[i];
        if (strncmp(blob, "sha256:", 7) == 0 && bd_blobs_have(blobs, blob + 7))
            reply->have[reply->n_have++] = bd_answer_text(blob);
    }
}

static void blob_have_back(uv_work_t *work, int status)
{
    struct bd_command *command = work->data;
    BD_ASSERT_CMP(status, ==, 0);
    if (bd_command_stop_here(command)) return;
    struct bd_answer answer = bd_answer_of(BOUNCED__ENVELOPE__BODY_BLOB_REPLY, command->blob_reply);
    command->blob_reply = NULL;
    bd_command_end(command, &answer);
}

static void blob_have(struct bd_command *command)
{
    command->blob_reply = malloc(sizeof *command->blob_reply);
    BD_ASSERT(command->blob_reply);
    bounced__blob_reply__init(command->blob_reply);
    bd_command_pool(command, blob_have_on_pool, blob_have_back);
}

static void devices_on_pool(uv_work_t *work)
{
    struct bd_command *command = work->data;
    if (command->loop->serving->list_devices)
        command->text = command->loop->serving->list_devices();
}

static void devices_back(uv_work_t *work, int status)
{
    struct bd_command *command = work->data;
    BD_ASSERT_CMP(status, ==, 0);
    if (bd_command_stop_here(command)) return;
    struct bd_answer answer = bd_answer_devices(command->loop->serving->sched, command->text);
    bd_command_end(command, &answer);
}

static void stats(struct bd_command *command)
{
    struct bd_answer answer = bd_answer_stats(command->loop);
    bd_command_end(command, &answer);
}

static void techniques(struct bd_command *command)
{
    struct bd_answer answer = bd_answer_techniques();
    bd_command_end(command, &answer);
}

static void options(struct bd_command *command)
{
    struct bd_answer answer = bd_answer_options();
    bd_command_end(command, &answer);
}

static void render(struct bd_command *command)
{
    const Bounced__Render *request = command->envelope->render;
    command->err = bd_frame_options_read(request->frame, &command->options, &command->fault);
    if (!command->err && !request->scene) {
        command->revision = 1;
        bd_command_import(command, bd_command_render);
        return;
    }
    const struct bd_store_entry *entry = NULL;
    if (!command->err && request->environment)
        command->err = bd_fault_set(&command->fault, BD_ERR_USAGE, "environment",
                                    "an environment comes with a file; a held scene has its own");
    if (!command->err)
        command->err =
            bd_store_get(command->loop->serving->store, request->scene, &entry, &command->fault);
    if (bd_command_stop_here(command)) return;
    command->scene = bd_scene_retain(entry->scene);
    command->revision = entry->revision;
    if (bd_command_render_remembered(command, entry)) return;
    bd_command_render(command);
}

// --- the table ------------------------------------------------------------------------------

static void scene_add(struct bd_command *command)
{
    bd_command_import(command, scene_add_then);
}

static void devices(struct bd_command *command)
{
    bd_command_pool(command, devices_on_pool, devices_back);
}

#define BODY(name) .body = BOUNCED__ENVELOPE__BODY_##name
#define OF_SCENE   .scene = "scene"

static const struct bd_command_row rows[] = {
    {BODY(BLOB_HAVE), .start = blob_have},
    {BODY(SCENE_ADD), .role = BD_ROLE_EDIT, .is_job = true, .http = "POST /v1/scenes",
     .start = scene_add},
    {BODY(SCENE_LIST), .http = "GET /v1/scenes", .start = bd_command_scene_list},
    {BODY(SCENE_GET), .scene = "id", .http = "GET /v1/scenes/ID", .start = bd_command_scene_get},
    {BODY(SCENE_REMOVE), .scene = "id", .role = BD_ROLE_EDIT, .http = "DELETE /v1/scenes/ID",
     .start = bd_command_scene_remove},
    {BODY(SCENE_LOG), OF_SCENE, .http = "GET /v1/scenes/ID/log", .start = bd_command_scene_log},
    {BODY(SCENE_EXPORT), OF_SCENE, .is_job = true, .http = "GET /v1/scenes/ID/export",
     .start = bd_command_export},
    {BODY(EDIT_BATCH), OF_SCENE, .role = BD_ROLE_EDIT, .has_payload = true,
     .http = "POST /v1/scenes/ID/edits", .start = bd_command_edit},
    {BODY(EDIT_UNDO), OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/undo",
     .start = bd_command_edit},
    {BODY(EDIT_REVERT), OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/revert",
     .start = bd_command_edit},
    {BODY(EDIT_COMMIT), OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/commit",
     .start = bd_command_edit},
    {BODY(REVISION_NAME), OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/names",
     .start = bd_command_edit},
    // A past that did not happen here.
    {BODY(SCENE_REPLAY), OF_SCENE, .role = BD_ROLE_ADMIN, .has_payload = true,
     .start = bd_command_replay},
    {BODY(RENDER), OF_SCENE, .is_job = true, .start = render},
    {BODY(DEVICES), .http = "GET /v1/devices", .start = devices},
    {BODY(STATS), .role = BD_ROLE_ADMIN, .http = "GET /v1/stats", .start = stats},
    {BODY(TECHNIQUES), .http = "GET /v1/techniques", .start = techniques},
    {BODY(OPTIONS), .http = "GET /v1/options", .start = options},
};
#define ROW_COUNT (sizeof rows / sizeof rows[0])

const struct bd_command_row *bd_command_row_at(uint32_t number)
{
    return number < ROW_COUNT ? &rows[number] : NULL;
}

const struct bd_command_row *bd_command_row_of(Bounced__Envelope__BodyCase body)
{
    for (size_t i = 0; i < ROW_COUNT; i++)
        if (rows[i].body == body) return &rows[i];
    return NULL;
}

const ProtobufCMessageDescriptor *bd_command_message(const struct bd_command_row *row)
{
    const ProtobufCFieldDescriptor *field = protobuf_c_message_descriptor_get_field(
        &bounced__envelope__descriptor, (unsigned)row->body);
    BD_ASSERT(field);
    return field->descriptor;
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
                                           start->payload_bytes, &command->fault);
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
    if (command->loop->draining)
        err = bd_fault_set(&command->fault, BD_ERR_BUSY, "", "the server is shutting down");
    if (!err && !command->row)
        err = bd_fault_set(&command->fault, BD_ERR_UNSUPPORTED, "body",
                           "this server knows no such request");
    if (!err) err = bd_command_check_rights(command, &command->fault);
    if (!err && bd_command_is_job(command)) {
        err = bd_client_begin_job(command->loop->clients, command->client, &command->fault);
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
                                   .loop = start->commands->loop,
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

    command->err = admit(command, start);
    if (command->err)
        bd_command_end_fault(command);
    else
        command->row->start(command);
    if (watch.ended) return NULL;
    command->events = start->events;
    command->user = start->user;
    return command;
}
