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
    bd_answer_finish(&command->answer);
    bounced__envelope__free_unpacked(command->envelope, NULL);
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

static void leave_queue(struct bd_command *command)
{
    if (!command->is_queued) return;
    command->is_queued = false;
    bd_edit_queue_leave(command->commands->commits, &command->place);
}

// With its answer, or its error.
static void end(struct bd_command *command)
{
    struct bd_answer answer = command->answer;
    command->answer = (struct bd_answer){0};
    leave_queue(command);
    if (command->err) {
        bd_answer_finish(&answer);
        answer = bd_answer_error(&command->fault);
        bd_command_tell_how_far(command, &answer);
        command->loop->counts.requests_refused++;
    }
    BD_ASSERT(answer.envelope); // the last step made one
    if (!command->abandoned) command->events->answer(command->user, &answer);
    bd_answer_finish(&answer);
    free_command(command);
}

// --- the runner ---------------------------------------------------------------------------------

static void come_back(struct bd_command *command);

static void tell_stage(struct bd_command *command)
{
    const char *stage = command->step->stage;
    if (stage && command->events->progress && !command->abandoned)
        command->events->progress(command->user, stage, -1);
}

static void run_on_pool(uv_work_t *work)
{
    struct bd_command *command = work->data;
    command->step->run(command);
}

static void pool_back(uv_work_t *work, int status)
{
    BD_ASSERT_CMP(status, ==, 0);
    come_back(work->data);
}

static void background_begun(struct bd_background *work)
{
    tell_stage(work->user);
}

static void run_in_background(struct bd_background *work)
{
    struct bd_command *command = work->user;
    command->step->run(command);
}

static void background_back(struct bd_background *work)
{
    struct bd_command *command = work->user;
    if (work->has_failed)
        command->err =
            bd_fault_set(&command->fault, BD_ERR_NO_MEMORY, "", "the system has no thread for it");
    come_back(command);
}

static void run_on_journal(struct bd_journal_turn *turn)
{
    struct bd_command *command = CONTAINER(turn, struct bd_command, turn);
    command->step->run(command);
}

static void journal_back(struct bd_journal_turn *turn)
{
    come_back(CONTAINER(turn, struct bd_command, turn));
}

static void frame_ended(struct bd_frame_job *frame_job)
{
    struct bd_command *command = frame_job->user;
    const struct bd_job_result *result = bd_job_result(command->job);
    command->err = result->err;
    command->fault = result->fault;
    if (command->err && command->fault.err != command->err)
        bd_fault_set(&command->fault, command->err, "", "the frame ended: %s",
                     bd_err_name(command->err));
    come_back(command);
}

static bool go_on(struct bd_command *command);

static void next_step(struct bd_command *command)
{
    command->step = command->branch ? command->branch : command->step + 1;
    command->branch = NULL;
}

// Runs while a commit is published, which asks the queue itself once all is told. A command that
// kept its turn is asked then, too.
static void on_disk(struct bd_commit_waiter *waiter, const struct bd_batch *batch, enum bd_err err,
                    const struct bd_fault *fault)
{
    struct bd_command *command = CONTAINER(waiter, struct bd_command, waiter);
    const bool is_held = command->step->on == BD_ON_DISK_HELD;
    command->batch = NULL;
    command->err = err;
    if (err) command->fault = *fault;
    if (!err) memcpy(command->scene_id, batch->scene_id, sizeof command->scene_id);
    next_step(command);
    if (is_held) command->place.has_begun = false;
    if (is_held && !err) return;
    go_on(command);
}

static bool begin_turn(struct bd_edit_place *place)
{
    struct bd_command *command = CONTAINER(place, struct bd_command, place);
    command->waits = false;
    return go_on(command);
}

static void wait_for_disk(struct bd_command *command)
{
    command->is_staged = command->step->on == BD_ON_DISK;
    command->waiter.done = on_disk;
    command->batch->user = &command->waiter;
    bd_commit_soon(command->commands->commits);
    if (command->is_staged) leave_queue(command);
}

// The turn may come, and the command end, before this returns.
static void wait_for_scene(struct bd_command *command)
{
    next_step(command);
    command->place.begin = begin_turn;
    command->is_queued = true;
    bd_edit_queue_join(command->commands->commits, &command->place);
}

static void submit_frame(struct bd_command *command)
{
    command->frame_job = (struct bd_frame_job){command->commands->live, command, frame_ended, NULL};
    command->step->run(command);
}

// True: it ran here. Otherwise it comes back, or may be over already.
static bool begin_step(struct bd_command *command)
{
    const struct bd_step *step = command->step;
    int result;
    if (step->on != BD_ON_BACKGROUND) tell_stage(command);
    switch (step->on) {
    case BD_ON_LOOP:
        step->run(command);
        return true;
    case BD_ON_POOL:
        command->work.data = command;
        result = uv_queue_work(&command->loop->uv, &command->work, run_on_pool, pool_back);
        BD_ASSERT_CMP(result, ==, 0);
        return false;
    case BD_ON_BACKGROUND:
        command->background = (struct bd_background){.user = command,
                                                     .lane = step->lane,
                                                     .begun = background_begun,
                                                     .run = run_in_background,
                                                     .back = background_back};
        bd_background_start(command->loop, &command->background);
        return false;
    case BD_ON_JOURNAL:
        command->turn = (struct bd_journal_turn){.on_pool = run_on_journal, .back = journal_back};
        bd_journal_turn_take(command->commands->commits, &command->turn);
        return false;
    case BD_ON_RENDER:
        submit_frame(command);
        return command->err != BD_ERR_OK;
    case BD_ON_SCENE:
        wait_for_scene(command);
        return false;
    case BD_ON_DISK:
    case BD_ON_DISK_HELD:
        wait_for_disk(command);
        return false;
    }
    return false;
}

static bool is_end(const struct bd_step *step)
{
    return step->on == BD_ON_LOOP && !step->run;
}

// The one place between two steps.
static bool is_over(struct bd_command *command)
{
    const bool is_late = command->is_staged || command->batch || command->answer.envelope;
    if (atomic_load(&command->cancelled) && !is_late && !command->err)
        command->err =
            bd_fault_set(&command->fault, BD_ERR_CANCELLED, "", "the request was cancelled");
    return command->err || is_end(command->step);
}

// False: its turn on the scene is not used, and comes again.
static bool go_on(struct bd_command *command)
{
    while (!is_over(command)) {
        if (!begin_step(command)) return true;
        if (command->waits) return false;
        next_step(command);
    }
    end(command);
    return true;
}

// Called by executors. The scene's next edit may begin behind a command that ended here.
static void come_back(struct bd_command *command)
{
    struct bd_commits *commits = command->commands->commits;
    next_step(command);
    if (!go_on(command)) command->place.has_begun = false;
    bd_edits_go_on(commits);
}

void bd_command_branch(struct bd_command *command, const struct bd_step *steps)
{
    command->branch = steps;
}

void bd_command_finish(struct bd_command *command)
{
    static const struct bd_step none[] = {BD_STEPS_END};
    command->branch = none;
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

// A background step that is dropped before it began does not come back, so that the command ends
// here. An edit's import has its place in the queue of edits, and comes to its own end.
static bool drop_waiting(struct bd_command *command)
{
    if (command->is_queued || !bd_background_drop(&command->background)) return false;
    go_on(command);
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

static void find_blobs(struct bd_command *command)
{
    const Bounced__BlobHave *request = command->envelope->blob_have;
    struct bd_blobs *blobs = bd_grant_blobs(command->loop->serving->blobs, command->grant);
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
}

static void list_devices(struct bd_command *command)
{
    const struct bd_serving *serving = command->loop->serving;
    if (serving->list_devices) command->text = serving->list_devices();
}

static void tell_devices(struct bd_command *command)
{
    command->answer = bd_answer_devices(command->loop->serving->sched, command->text);
}

static void tell_stats(struct bd_command *command)
{
    command->answer = bd_answer_stats(command->loop);
}

static void tell_techniques(struct bd_command *command)
{
    command->answer = bd_answer_techniques();
}

static void tell_options(struct bd_command *command)
{
    command->answer = bd_answer_options();
}

static const struct bd_step blob_have[] = {BD_STEP(POOL, find_blobs), BD_STEPS_END};
static const struct bd_step devices[] = {BD_STEP(POOL, list_devices), BD_STEP(LOOP, tell_devices),
                                         BD_STEPS_END};
static const struct bd_step stats[] = {BD_STEP(LOOP, tell_stats), BD_STEPS_END};
static const struct bd_step techniques[] = {BD_STEP(LOOP, tell_techniques), BD_STEPS_END};
static const struct bd_step options[] = {BD_STEP(LOOP, tell_options), BD_STEPS_END};

// --- the table ------------------------------------------------------------------------------

#define BODY(name) .body = BOUNCED__ENVELOPE__BODY_##name
#define OF_SCENE   .scene = "scene"

static const struct bd_command_row rows[] = {
    {BODY(BLOB_HAVE), .steps = blob_have},
    {BODY(SCENE_ADD), .role = BD_ROLE_EDIT, .is_job = true, .http = "POST /v1/scenes",
     .steps = bd_steps_scene_add},
    {BODY(SCENE_LIST), .http = "GET /v1/scenes", .steps = bd_steps_scene_list},
    {BODY(SCENE_GET), .scene = "id", .http = "GET /v1/scenes/ID", .steps = bd_steps_scene_get},
    {BODY(SCENE_REMOVE), .scene = "id", .role = BD_ROLE_EDIT, .http = "DELETE /v1/scenes/ID",
     .steps = bd_steps_scene_remove},
    {BODY(SCENE_LOG), OF_SCENE, .http = "GET /v1/scenes/ID/log", .steps = bd_steps_scene_log},
    {BODY(SCENE_EXPORT), OF_SCENE, .is_job = true, .http = "GET /v1/scenes/ID/export",
     .steps = bd_steps_export},
    {BODY(EDIT_BATCH), OF_SCENE, .role = BD_ROLE_EDIT, .has_payload = true,
     .http = "POST /v1/scenes/ID/edits", .steps = bd_steps_edit, .turn_steps = bd_steps_batch},
    {BODY(EDIT_UNDO), OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/undo",
     .steps = bd_steps_edit, .turn_steps = bd_steps_undo},
    {BODY(EDIT_REVERT), OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/revert",
     .steps = bd_steps_edit, .turn_steps = bd_steps_revert},
    {BODY(EDIT_COMMIT), OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/commit",
     .steps = bd_steps_edit, .turn_steps = bd_steps_commit},
    {BODY(REVISION_NAME), OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/names",
     .steps = bd_steps_edit, .turn_steps = bd_steps_name},
    // A past that did not happen here.
    {BODY(SCENE_REPLAY), OF_SCENE, .role = BD_ROLE_ADMIN, .has_payload = true,
     .steps = bd_steps_replay, .turn_steps = bd_steps_replay_edit},
    {BODY(RENDER), OF_SCENE, .is_job = true, .steps = bd_steps_render},
    {BODY(DEVICES), .http = "GET /v1/devices", .steps = devices},
    {BODY(STATS), .role = BD_ROLE_ADMIN, .http = "GET /v1/stats", .steps = stats},
    {BODY(TECHNIQUES), .http = "GET /v1/techniques", .steps = techniques},
    {BODY(OPTIONS), .http = "GET /v1/options", .steps = options},
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
    command->step = command->row ? command->row->steps : NULL;
    go_on(command);
    if (watch.ended) return NULL;
    command->events = start->events;
    command->user = start->user;
    return command;
}
