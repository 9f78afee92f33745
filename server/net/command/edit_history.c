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
static enum bd_err refuse_unfit(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const struct bd_err_detail why = command->steps.detail;
    return bd_err_set(&command->steps.detail, BD_ERR_CONFLICT,
                      work->kind == BD_BATCH_REDO ? "redo" : "undo",
                      "revision %" PRIu64 " cannot be taken back by itself any more: "
                      "%.200s",
                      work->of, why.message);
}

static enum bd_err stage_read(struct bd_command *command)
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
    enum bd_err err = bd_command_check_growth(command, command->place.scene_id, work->base,
                                              &work->delta, &command->steps.detail);
    if (!err)
        err = bd_store_stage(command->steps.loop->serving->store, &change, &command->place.batch,
                             &command->steps.detail);
    if (err == BD_ERR_BAD_INPUT && work->is_mine) return refuse_unfit(work);
    if (err) return err;
    if (command->time_ms) command->place.batch->time_ms = command->time_ms;
    command->answer = bd_edit_reply_of_batch(command->place.batch, work);
    return BD_ERR_OK;
}

// A head that has moved since is looked at first: what is wrong with a past read for it is nobody's
// error.
static enum bd_err read_delta(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    enum bd_err err = bd_edit_work_read_past(work, command->steps.loop->serving->journal);
    if (err) work->read_detail = command->steps.detail;
    work->read_detail.err = err;
    return BD_ERR_OK;
}

// What others laid may have become durable by itself meanwhile: what was read does not fit then.
static bool has_moved(struct bd_command *command)
{
    const struct bd_scene *head;
    uint64_t revision;
    return !bd_store_head(command->steps.loop->serving->store, command->place.scene_id, &head,
                          &revision, NULL) &&
           revision != command->edit->head_revision;
}

static const struct bd_step past_steps[5]; // the file's end has them

static enum bd_err stage_past(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    if (has_moved(command)) {
        bd_delta_finish(&work->delta);
        bd_release_scene(command->steps.loop, &work->base);
        bd_steps_branch(&command->steps, past_steps);
        return BD_ERR_OK;
    }
    if (!work->read_detail.err) return stage_read(command);
    command->steps.detail = work->read_detail;
    return work->read_detail.err;
}

// What lies transient is the last thing that was done: it is committed before anything is taken
// back; of others only before what is anybody's is. `last`: the last batch of it; NULL: none.
static enum bd_err settle(struct bd_command *command, struct bd_batch **last)
{
    const struct bd_edit_work *work = command->edit;
    struct bd_batch *batch = NULL;
    enum bd_err err;
    *last = NULL;
    do {
        *last = batch ? batch : *last;
        err = bd_store_stage_commit(command->steps.loop->serving->store, command->place.scene_id,
                                    work->is_mine ? work->author : NULL, NULL, &batch,
                                    &command->steps.detail);
    } while (!err && batch);
    return err;
}

static enum bd_err check_base(struct bd_command *command)
{
    const struct bd_edit_work *work = command->edit;
    if (!work->base_revision || work->base_revision == work->head_revision) return BD_ERR_OK;
    return bd_err_set(&command->steps.detail, BD_ERR_CONFLICT, "base_revision",
                      "the scene is at revision %" PRIu64 ", not %" PRIu64, work->head_revision,
                      work->base_revision);
}

static enum bd_err find_past(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    const struct bd_store *store = command->steps.loop->serving->store;
    const struct bd_scene *head = NULL;
    enum bd_err err = BD_ERR_OK;
    if (work->kind != BD_BATCH_REVERT)
        err = bd_store_undo_target(store, command->place.scene_id,
                                   work->is_mine ? work->author : NULL, work->kind == BD_BATCH_REDO,
                                   &work->of, &command->steps.detail);
    if (!err)
        err = bd_store_head(store, command->place.scene_id, &head, &work->head_revision,
                            &command->steps.detail);
    if (!err) err = check_base(command);
    if (!err) work->base = bd_scene_retain((struct bd_scene *)head);
    return err;
}

static const struct bd_step settle_steps[6];

// Where something had to be settled it begins anew behind that. What of it is staged goes to the
// disk even where another part of it fails.
static enum bd_err begin_past(struct bd_command *command)
{
    struct bd_batch *last;
    if (bd_store_is_busy(command->steps.loop->serving->store, command->place.scene_id)) {
        bd_edit_queue_wait(&command->place);
        return BD_ERR_OK;
    }
    enum bd_err err = settle(command, &last);
    if (!last) return err ? err : find_past(command);
    if (err) {
        bd_commit_soon(command->commands->commits);
        return err;
    }
    command->place.batch = last;
    bd_steps_branch(&command->steps, settle_steps);
    return BD_ERR_OK;
}

#define PAST_STEPS                                                                                 \
    BD_STEP(loop, begin_past), BD_STEP(journal, read_delta), BD_STEP(loop, stage_past),            \
        BD_STEP(disk, NULL), BD_STEPS_END

static const struct bd_step past_steps[5] = {PAST_STEPS};
static const struct bd_step settle_steps[6] = {BD_STEP(disk_held, NULL), PAST_STEPS};

static enum bd_err read_undo(struct bd_command *command)
{
    const Bounced__EditUndo *request = command->envelope->edit_undo;
    struct bd_edit_work *work = command->edit;
    const char *scope = request->scope ? request->scope : "mine";
    work->kind = request->redo ? BD_BATCH_REDO : BD_BATCH_UNDO;
    work->is_mine = strcmp(scope, "mine") == 0;
    work->base_revision = request->base_revision;
    if (!work->is_mine && strcmp(scope, "all") != 0)
        return bd_err_set(&command->steps.detail, BD_ERR_USAGE, "scope",
                          "scope is mine or all, not \"%.32s\"", scope);
    return BD_ERR_OK;
}

static enum bd_err read_revert(struct bd_command *command)
{
    const Bounced__EditRevert *request = command->envelope->edit_revert;
    struct bd_edit_work *work = command->edit;
    work->kind = BD_BATCH_REVERT;
    work->of = request->revision;
    work->base_revision = request->base_revision;
    if ((request->revision != 0) == (request->name != NULL))
        return bd_err_set(&command->steps.detail, BD_ERR_USAGE, "revision",
                          "a revert names a revision or a name: one of them");
    return BD_ERR_OK;
}

// --- a revision out of a journal -------------------------------------------------------------

static enum bd_err begin_replay(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    const struct bd_scene *head = NULL;
    uint64_t revision;
    enum bd_err err = bd_store_head(command->steps.loop->serving->store, command->place.scene_id,
                                    &head, &revision, &command->steps.detail);
    if (!err) err = bd_edit_replay_check(work, revision);
    if (!err) work->base = bd_scene_retain((struct bd_scene *)head);
    return err;
}

static enum bd_err read_replay(struct bd_command *command)
{
    return bd_edit_replay_read(command->edit);
}

// --- commit, names --------------------------------------------------------------------------

static enum bd_err stage_commit(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    struct bd_store *store = command->steps.loop->serving->store;
    const struct bd_store_entry *entry;
    enum bd_err err =
        bd_store_stage_commit(store, command->place.scene_id, work->author, work->client_edit_id,
                              &command->place.batch, &command->steps.detail);
    // What lay there may be on its way already, by itself: it is answered for, too.
    if (err == BD_ERR_BUSY ||
        (!err && !command->place.batch && bd_store_is_busy(store, command->place.scene_id))) {
        bd_edit_queue_wait(&command->place);
        return BD_ERR_OK;
    }
    if (!err && command->place.batch)
        command->answer = bd_edit_reply_of_batch(command->place.batch, work);
    if (err || command->place.batch) return err;
    err = bd_store_get(store, command->place.scene_id, &entry, &command->steps.detail);
    if (!err) command->answer = bd_edit_reply_of_entry(entry, work);
    bd_steps_finish(&command->steps);
    return err;
}

static enum bd_err stage_name(struct bd_command *command)
{
    const Bounced__RevisionName *request = command->envelope->revision_name;
    enum bd_err err = bd_store_stage_name(
        command->steps.loop->serving->store, command->place.scene_id, request->name,
        request->revision, request->remove, &command->place.batch, &command->steps.detail);
    if (!err) command->answer = bd_answer_done();
    return err;
}

// --- the rows -------------------------------------------------------------------------------

const struct bd_step bd_steps_replay_edit[] = {
    BD_STEP(loop, begin_replay), BD_STEP(pool, read_replay), BD_STEP(loop, stage_read),
    BD_STEP(disk, NULL), BD_STEPS_END};

static const struct bd_step undo[] = {BD_STEP(loop, read_undo), PAST_STEPS};
static const struct bd_step revert[] = {BD_STEP(loop, read_revert), PAST_STEPS};
static const struct bd_step commit[] = {BD_STEP(loop, stage_commit), BD_STEP(disk, NULL),
                                        BD_STEPS_END};
static const struct bd_step name[] = {BD_STEP(loop, stage_name), BD_STEP(disk, NULL), BD_STEPS_END};

const struct bd_command_row bd_rows_of_history[] = {
    {BD_BODY(EDIT_UNDO), BD_OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/undo",
     .steps = bd_steps_edit, .turn_steps = undo},
    {BD_BODY(EDIT_REVERT), BD_OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/revert",
     .steps = bd_steps_edit, .turn_steps = revert},
    {BD_BODY(EDIT_COMMIT), BD_OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/commit",
     .steps = bd_steps_edit, .turn_steps = commit},
    {BD_BODY(REVISION_NAME), BD_OF_SCENE, .role = BD_ROLE_EDIT, .http = "POST /v1/scenes/ID/names",
     .steps = bd_steps_edit, .turn_steps = name},
    BD_ROWS_END,
};
