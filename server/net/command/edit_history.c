// Requests about what was done to a scene, once they have the turn on it: undo and redo, revert,
// the commit of what lies transient, names of revisions, what is played from a journal.

#include <inttypes.h>
#include <string.h>

#include "base/assert.h"
#include "net/command/command_rights.h"
#include "net/command/edit_replay.h"
#include "net/command/edit_reply.h"
#include "net/command/edit_work.h"
#include "net/commit/commit.h"
#include "net/loop/release.h"

// --- undo, redo, revert ---------------------------------------------------------------------

// What one's own edit made is needed by what others made since.
static void refuse_unfit(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const struct bd_fault why = command->fault;
    command->err = bd_fault_set(&command->fault, BD_ERR_CONFLICT,
                                work->kind == BD_BATCH_REDO ? "redo" : "undo",
                                "revision %" PRIu64 " cannot be taken back by itself any more: "
                                "%.200s",
                                work->of, why.message);
}

static void stage_read(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    const struct bd_store_change change = {.scene_id = command->place.scene_id,
                                           .kind = work->kind,
                                           .of = work->of,
                                           .base_revision = work->head_revision,
                                           .client_edit_id = work->client_edit_id,
                                           .message = work->message,
                                           .author = work->author,
                                           .delta = &work->delta};
    command->err = bd_command_check_growth(command, command->place.scene_id, work->base,
                                           &work->delta, &command->fault);
    if (!command->err)
        command->err = bd_store_stage(command->loop->serving->store, &change, &command->batch,
                                      &command->fault);
    if (command->err == BD_ERR_BAD_INPUT && work->is_mine) refuse_unfit(work);
    if (command->err) return;
    if (command->time_ms) command->batch->time_ms = command->time_ms;
    command->answer = bd_edit_reply_of_batch(command->batch, work);
}

static void read_delta(struct bd_command *command)
{
    command->edit->read_err =
        bd_edit_work_read_past(command->edit, command->loop->serving->journal);
}

// What others laid may have become durable by itself meanwhile: what was read does not fit then.
static bool has_moved(struct bd_command *command)
{
    const struct bd_scene *head;
    uint64_t revision;
    return !bd_store_head(command->loop->serving->store, command->place.scene_id, &head, &revision,
                          NULL) &&
           revision != command->edit->head_revision;
}

static const struct bd_step past_steps[5]; // the file's end has them

static void stage_past(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    if (has_moved(command)) {
        bd_delta_finish(&work->delta);
        bd_release_scene(command->loop, &work->base);
        bd_command_branch(command, past_steps);
        return;
    }
    command->err = work->read_err;
    if (!command->err) stage_read(command);
}

// What lies transient is the last thing that was done: it is committed before anything is taken
// back; of others only before what is anybody's is. NULL: there is none.
static struct bd_batch *settle(struct bd_command *command)
{
    const struct bd_edit_work *work = command->edit;
    struct bd_batch *batch = NULL, *last = NULL;
    do {
        last = batch ? batch : last;
        command->err = bd_store_stage_commit(command->loop->serving->store, command->place.scene_id,
                                             work->is_mine ? work->author : NULL, NULL, &batch,
                                             &command->fault);
    } while (!command->err && batch);
    return last;
}

static enum bd_err check_base(struct bd_command *command)
{
    const struct bd_edit_work *work = command->edit;
    if (!work->base_revision || work->base_revision == work->head_revision) return BD_ERR_OK;
    return bd_fault_set(&command->fault, BD_ERR_CONFLICT, "base_revision",
                        "the scene is at revision %" PRIu64 ", not %" PRIu64, work->head_revision,
                        work->base_revision);
}

static enum bd_err find_past(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    const struct bd_store *store = command->loop->serving->store;
    const struct bd_scene *head = NULL;
    enum bd_err err = BD_ERR_OK;
    if (work->kind != BD_BATCH_REVERT)
        err = bd_store_undo_target(store, command->place.scene_id,
                                   work->is_mine ? work->author : NULL, work->kind == BD_BATCH_REDO,
                                   &work->of, &command->fault);
    if (!err)
        err = bd_store_head(store, command->place.scene_id, &head, &work->head_revision,
                            &command->fault);
    if (!err) err = check_base(command);
    if (!err) work->base = bd_scene_retain((struct bd_scene *)head);
    return err;
}

static const struct bd_step settle_steps[6];

// Where something had to be settled it begins anew behind that. What of it is staged goes to the
// disk even where another part of it fails.
static void begin_past(struct bd_command *command)
{
    command->waits = bd_store_is_busy(command->loop->serving->store, command->place.scene_id);
    if (command->waits) return;
    struct bd_batch *last = settle(command);
    if (last && !command->err) {
        command->batch = last;
        bd_command_branch(command, settle_steps);
        return;
    }
    if (last) bd_commit_soon(command->commands->commits);
    if (!command->err) command->err = find_past(command);
}

#define PAST_STEPS                                                                                 \
    BD_STEP(LOOP, begin_past), BD_STEP(JOURNAL, read_delta), BD_STEP(LOOP, stage_past),            \
        BD_STEP(DISK, NULL), BD_STEPS_END

static const struct bd_step past_steps[5] = {PAST_STEPS};
static const struct bd_step settle_steps[6] = {BD_STEP(DISK_HELD, NULL), PAST_STEPS};

static void read_undo(struct bd_command *command)
{
    const Bounced__EditUndo *request = command->envelope->edit_undo;
    struct bd_edit_work *work = command->edit;
    const char *scope = request->scope ? request->scope : "mine";
    work->kind = request->redo ? BD_BATCH_REDO : BD_BATCH_UNDO;
    work->is_mine = strcmp(scope, "mine") == 0;
    work->base_revision = request->base_revision;
    if (!work->is_mine && strcmp(scope, "all") != 0)
        command->err = bd_fault_set(&command->fault, BD_ERR_USAGE, "scope",
                                    "scope is mine or all, not \"%.32s\"", scope);
}

static void read_revert(struct bd_command *command)
{
    const Bounced__EditRevert *request = command->envelope->edit_revert;
    struct bd_edit_work *work = command->edit;
    work->kind = BD_BATCH_REVERT;
    work->of = request->revision;
    work->base_revision = request->base_revision;
    if ((request->revision != 0) == (request->name != NULL))
        command->err = bd_fault_set(&command->fault, BD_ERR_USAGE, "revision",
                                    "a revert names a revision or a name: one of them");
}

// --- a revision out of a journal -------------------------------------------------------------

static void begin_replay(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    const struct bd_scene *head = NULL;
    uint64_t revision;
    command->err = bd_store_head(command->loop->serving->store, command->place.scene_id, &head,
                                 &revision, &command->fault);
    if (!command->err) command->err = bd_edit_replay_check(work, revision);
    if (!command->err) work->base = bd_scene_retain((struct bd_scene *)head);
}

static void read_replay(struct bd_command *command)
{
    command->err = bd_edit_replay_read(command->edit);
}

// --- commit, names --------------------------------------------------------------------------

static void stage_commit(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    struct bd_store *store = command->loop->serving->store;
    const struct bd_store_entry *entry;
    enum bd_err err = bd_store_stage_commit(store, command->place.scene_id, work->author,
                                            work->client_edit_id, &command->batch, &command->fault);
    // What lay there may be on its way already, by itself: it is answered for, too.
    command->waits = err == BD_ERR_BUSY ||
                     (!err && !command->batch && bd_store_is_busy(store, command->place.scene_id));
    if (command->waits) return;
    command->err = err;
    if (!err && command->batch) command->answer = bd_edit_reply_of_batch(command->batch, work);
    if (err || command->batch) return;
    command->err = bd_store_get(store, command->place.scene_id, &entry, &command->fault);
    if (!command->err) command->answer = bd_edit_reply_of_entry(entry, work);
    bd_command_finish(command);
}

static void stage_name(struct bd_command *command)
{
    const Bounced__RevisionName *request = command->envelope->revision_name;
    command->err =
        bd_store_stage_name(command->loop->serving->store, command->place.scene_id, request->name,
                            request->revision, request->remove, &command->batch, &command->fault);
    if (!command->err) command->answer = bd_answer_done();
}

// --- the steps ------------------------------------------------------------------------------

const struct bd_step bd_steps_undo[] = {BD_STEP(LOOP, read_undo), PAST_STEPS};
const struct bd_step bd_steps_revert[] = {BD_STEP(LOOP, read_revert), PAST_STEPS};
const struct bd_step bd_steps_replay_edit[] = {
    BD_STEP(LOOP, begin_replay), BD_STEP(POOL, read_replay), BD_STEP(LOOP, stage_read),
    BD_STEP(DISK, NULL), BD_STEPS_END};
const struct bd_step bd_steps_commit[] = {BD_STEP(LOOP, stage_commit), BD_STEP(DISK, NULL),
                                          BD_STEPS_END};
const struct bd_step bd_steps_name[] = {BD_STEP(LOOP, stage_name), BD_STEP(DISK, NULL),
                                        BD_STEPS_END};
