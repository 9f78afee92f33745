#include "net/command/edit_history.h"

#include <inttypes.h>
#include <string.h>

#include "base/assert.h"
#include "net/command/command_rights.h"
#include "net/command/edit_end.h"
#include "net/command/edit_replay.h"
#include "net/command/edit_reply.h"
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

static void stage_read(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const struct bd_store_change change = {.scene_id = work->place.scene_id,
                                           .kind = work->kind,
                                           .of = work->of,
                                           .base_revision = work->head_revision,
                                           .client_edit_id = work->client_edit_id,
                                           .message = work->message,
                                           .author = work->author,
                                           .delta = &work->delta};
    struct bd_batch *batch;
    command->err = bd_command_check_growth(command, work->place.scene_id, work->base, &work->delta,
                                           &command->fault);
    if (!command->err)
        command->err =
            bd_store_stage(command->loop->serving->store, &change, &batch, &command->fault);
    if (command->err == BD_ERR_BAD_INPUT && work->is_mine) refuse_unfit(work);
    if (bd_edit_stop_here(work)) return;
    if (command->time_ms) batch->time_ms = command->time_ms;
    bd_edit_wait_for_disk(work, batch, bd_edit_reply_of_batch(batch, work));
}

static void read_delta_on_pool(struct bd_journal_turn *turn)
{
    struct bd_edit_work *work = bd_edit_work_of_turn(turn);
    work->command->err = bd_edit_work_read_past(work, turn->commits->loop->serving->journal);
}

// What others laid may have become durable by itself meanwhile: what was read does not fit then.
static bool begin_again(struct bd_edit_work *work)
{
    const struct bd_scene *head;
    uint64_t revision;
    if (bd_store_head(work->command->loop->serving->store, work->place.scene_id, &head, &revision,
                      NULL) ||
        revision == work->head_revision)
        return false;
    bd_delta_finish(&work->delta);
    bd_release_scene(work->command->loop, &work->base);
    work->command->err = BD_ERR_OK;
    work->place.has_begun = false;
    return true;
}

static void read_delta_back(struct bd_journal_turn *turn)
{
    struct bd_edit_work *work = bd_edit_work_of_turn(turn);
    struct bd_commits *commits = turn->commits;
    if (!begin_again(work) && !bd_edit_stop_here(work)) stage_read(work);
    bd_edits_go_on(commits);
}

// Published: it begins anew, once all who wait are asked. Refused: nothing is taken back from
// beneath what still lies there.
static void on_settled(struct bd_commit_waiter *waiter, const struct bd_batch *batch,
                       enum bd_err err, const struct bd_fault *fault)
{
    struct bd_edit_work *work = (struct bd_edit_work *)waiter;
    (void)batch;
    work->place.has_begun = false;
    if (!err) return;
    work->command->err = err;
    work->command->fault = *fault;
    bool stopped = bd_edit_stop_here(work);
    BD_ASSERT(stopped);
}

// What lies transient is the last thing that was done: it is committed before anything is taken
// back; of others only before what is anybody's is. True: it is on its way, and `work` hears of it.
static bool settle(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    struct bd_batch *batch = NULL, *last = NULL;
    do {
        last = batch ? batch : last;
        command->err = bd_store_stage_commit(command->loop->serving->store, work->place.scene_id,
                                             work->is_mine ? work->author : NULL, NULL, &batch,
                                             &command->fault);
    } while (!command->err && batch);
    if (last) bd_commit_soon(command->commands->commits);
    if (command->err || !last) return false;
    work->waiter.done = on_settled;
    last->user = &work->waiter;
    return true;
}

static bool begin_past(struct bd_edit_work *work, uint64_t base_revision)
{
    struct bd_command *command = work->command;
    const struct bd_store *store = command->loop->serving->store;
    const struct bd_scene *head = NULL;
    if (bd_store_is_busy(store, work->place.scene_id)) return false;
    if (settle(work)) return true;
    if (!command->err && work->kind != BD_BATCH_REVERT)
        command->err =
            bd_store_undo_target(store, work->place.scene_id, work->is_mine ? work->author : NULL,
                                 work->kind == BD_BATCH_REDO, &work->of, &command->fault);
    if (!command->err)
        command->err = bd_store_head(store, work->place.scene_id, &head, &work->head_revision,
                                     &command->fault);
    if (!command->err && base_revision && base_revision != work->head_revision)
        command->err = bd_fault_set(&command->fault, BD_ERR_CONFLICT, "base_revision",
                                    "the scene is at revision %" PRIu64 ", not %" PRIu64,
                                    work->head_revision, base_revision);
    if (bd_edit_stop_here(work)) return true;
    work->base = bd_scene_retain((struct bd_scene *)head);
    work->turn.on_pool = read_delta_on_pool;
    work->turn.back = read_delta_back;
    bd_journal_turn_take(command->commands->commits, &work->turn);
    return true;
}

bool bd_edit_begin_undo(struct bd_edit_work *work)
{
    const Bounced__EditUndo *request = work->command->envelope->edit_undo;
    struct bd_command *command = work->command;
    const char *scope = request->scope ? request->scope : "mine";
    work->kind = request->redo ? BD_BATCH_REDO : BD_BATCH_UNDO;
    work->is_mine = strcmp(scope, "mine") == 0;
    if (!work->is_mine && strcmp(scope, "all") != 0)
        command->err = bd_fault_set(&command->fault, BD_ERR_USAGE, "scope",
                                    "scope is mine or all, not \"%.32s\"", scope);
    if (bd_edit_stop_here(work)) return true;
    return begin_past(work, request->base_revision);
}

bool bd_edit_begin_revert(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const Bounced__EditRevert *request = command->envelope->edit_revert;
    work->kind = BD_BATCH_REVERT;
    if ((request->revision != 0) == (request->name != NULL))
        command->err = bd_fault_set(&command->fault, BD_ERR_USAGE, "revision",
                                    "a revert names a revision or a name: one of them");
    if (bd_edit_stop_here(work)) return true;
    work->of = request->revision;
    return begin_past(work, request->base_revision);
}

// --- a revision out of a journal -------------------------------------------------------------

static void read_replay_on_pool(uv_work_t *pool)
{
    struct bd_command *command = pool->data;
    command->err = bd_edit_replay_read(command->edit);
}

static void read_replay_back(uv_work_t *pool, int status)
{
    struct bd_command *command = pool->data;
    struct bd_commits *commits = command->commands->commits;
    BD_ASSERT_CMP(status, ==, 0);
    if (!bd_edit_stop_here(command->edit)) stage_read(command->edit);
    bd_edits_go_on(commits);
}

bool bd_edit_begin_replay(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const struct bd_scene *head = NULL;
    uint64_t revision;
    command->err = bd_store_head(command->loop->serving->store, work->place.scene_id, &head,
                                 &revision, &command->fault);
    if (!command->err) command->err = bd_edit_replay_check(work, revision);
    if (bd_edit_stop_here(work)) return true;
    work->base = bd_scene_retain((struct bd_scene *)head);
    bd_command_pool(command, read_replay_on_pool, read_replay_back);
    return true;
}

// --- commit, names --------------------------------------------------------------------------

bool bd_edit_begin_commit(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    struct bd_store *store = command->loop->serving->store;
    struct bd_batch *batch = NULL;
    enum bd_err err = bd_store_stage_commit(store, work->place.scene_id, work->author,
                                            work->client_edit_id, &batch, &command->fault);
    if (err == BD_ERR_BUSY) return false;
    // What lay there may be on its way already, by itself: it is answered for, too.
    if (!err && !batch && bd_store_is_busy(store, work->place.scene_id)) return false;
    command->err = err;
    if (bd_edit_stop_here(work)) return true;
    if (batch) {
        bd_edit_wait_for_disk(work, batch, bd_edit_reply_of_batch(batch, work));
        return true;
    }
    const struct bd_store_entry *entry;
    command->err = bd_store_get(store, work->place.scene_id, &entry, &command->fault);
    if (!bd_edit_stop_here(work)) bd_edit_end(work, bd_edit_reply_of_entry(entry, work));
    return true;
}

bool bd_edit_begin_name(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const Bounced__RevisionName *request = command->envelope->revision_name;
    struct bd_batch *batch = NULL;
    command->err =
        bd_store_stage_name(command->loop->serving->store, work->place.scene_id, request->name,
                            request->revision, request->remove, &batch, &command->fault);
    if (!bd_edit_stop_here(work)) bd_edit_wait_for_disk(work, batch, bd_answer_done());
    return true;
}
