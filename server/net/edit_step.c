#include "net/edit_step.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "net/command_rights.h"
#include "net/commit.h"
#include "net/edit_dry_run.h"
#include "net/edit_replay.h"
#include "net/edit_reply.h"
#include "net/edit_work.h"

#define QUIET_NS 1000000000ull

// --- ends -----------------------------------------------------------------------------------

static void end(struct bd_edit_work *work, struct bd_answer answer)
{
    bd_edit_work_leave(work);
    bd_command_end(work->command, &answer);
}

// True, and the command is over, if there is nothing to go on with.
static bool stop_here(struct bd_edit_work *work)
{
    if (!work->command->err && !atomic_load(&work->command->cancelled)) return false;
    bd_edit_work_leave(work);
    return bd_command_stop_here(work->command);
}

static void on_committed(struct bd_commit_waiter *waiter, const struct bd_batch *batch,
                         enum bd_err err, const struct bd_fault *fault)
{
    struct bd_edit_work *work = (struct bd_edit_work *)waiter;
    struct bd_command *command = work->command;
    (void)batch;
    if (err) {
        command->err = err;
        command->fault = *fault;
        bd_command_end_fault(command);
        return;
    }
    struct bd_answer answer = work->answer;
    work->answer = (struct bd_answer){0};
    bd_command_end(command, &answer);
}

// The batch is staged: the answer waits for the disk, the queue does not.
static void wait_for_disk(struct bd_edit_work *work, struct bd_batch *batch,
                          struct bd_answer answer)
{
    work->answer = answer;
    work->waiter.done = on_committed;
    batch->user = &work->waiter;
    bd_commit_soon(work->command->net);
    bd_edit_work_leave(work);
}

// --- batches --------------------------------------------------------------------------------

static void stage_durable(struct bd_edit_work *work, const Bounced__EditBatch *request)
{
    struct bd_command *command = work->command;
    const struct bd_store_change change = {.scene_id = work->place.scene_id,
                                           .kind = BD_BATCH_EDIT,
                                           .base_revision = request->base_revision,
                                           .client_edit_id = request->client_edit_id,
                                           .message = request->message,
                                           .delta = &work->delta};
    struct bd_batch *batch;
    command->err = bd_store_stage(command->net->options.store, &change, &batch, &command->fault);
    if (stop_here(work)) return;
    wait_for_disk(work, batch, bd_edit_reply_of_batch(batch, work));
}

static void lay_transient(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const struct bd_store_entry *entry;
    command->err = bd_store_lay(command->net->options.store, work->place.scene_id, &work->delta,
                                &entry, &command->fault);
    if (stop_here(work)) return;
    struct bd_answer answer = bd_edit_reply_of_entry(entry, work);
    bd_edit_watch_quiet(command->net);
    bd_net_scene_changed(command->net, work->place.scene_id, "transient", &work->delta);
    end(work, answer);
}

static enum bd_err check_transient_base(const struct bd_store_entry *entry,
                                        const Bounced__EditBatch *request, struct bd_fault *fault)
{
    if (!request->base_revision || request->base_revision == entry->revision) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_CONFLICT, "base_revision",
                        "the scene is at revision %" PRIu64 ", not %" PRIu64, entry->revision,
                        request->base_revision);
}

// What the operations are checked against: what is shown if they lie over it, else the head.
static enum bd_err find_base(struct bd_edit_work *work, const struct bd_scene **out)
{
    struct bd_command *command = work->command;
    const struct bd_store *store = command->net->options.store;
    const struct bd_store_entry *entry;
    uint64_t revision;
    if (!work->is_transient)
        return bd_store_head(store, work->place.scene_id, out, &revision, &command->fault);
    enum bd_err err = bd_store_get(store, work->place.scene_id, &entry, &command->fault);
    if (!err) err = check_transient_base(entry, command->envelope->edit_batch, &command->fault);
    if (!err) *out = entry->scene;
    return err;
}

static void stage_batch(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const Bounced__EditBatch *request = command->envelope->edit_batch;
    const struct bd_scene *base = NULL;
    if (stop_here(work)) return;
    command->err = find_base(work, &base);
    if (!command->err)
        command->err =
            bd_edit_check(base, work->ops, (uint32_t)work->op_count, &bd_edit_default_limits,
                          &work->delta, work->ids, &command->fault);
    if (!command->err)
        command->err = bd_command_check_growth(command, work->place.scene_id, base, &work->delta,
                                               &command->fault);
    if (stop_here(work)) return;
    if (request->dry_run)
        bd_edit_dry_run(work, base);
    else if (work->is_transient)
        lay_transient(work);
    else
        stage_durable(work, request);
}

static void read_heavy_on_pool(uv_work_t *pool)
{
    struct bd_command *command = pool->data;
    command->err = bd_edit_work_read_heavy(command->edit);
}

static void read_heavy_back(uv_work_t *pool, int status)
{
    struct bd_command *command = pool->data;
    struct bd_net *net = command->net;
    BD_ASSERT_CMP(status, ==, 0);
    stage_batch(command->edit);
    bd_edits_go_on(net);
}

static bool begin_batch(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const struct bd_scene *base = NULL;
    bool is_heavy = false;
    command->err = bd_edit_work_decode(work, &is_heavy);
    if (!command->err) command->err = find_base(work, &base);
    if (stop_here(work)) return true;
    if (!is_heavy) {
        stage_batch(work);
        return true;
    }
    work->base = bd_scene_retain((struct bd_scene *)base);
    bd_command_pool(command, read_heavy_on_pool, read_heavy_back);
    return true;
}

// --- a batch that was there before -----------------------------------------------------------

static void read_answer_on_pool(struct bd_journal_turn *turn)
{
    struct bd_edit_work *work = bd_edit_work_of_turn(turn);
    struct bd_command *command = work->command;
    struct bd_journal_edit edit;
    work->is_repeated = false;
    enum bd_err err = bd_journal_find_edit(turn->net->options.journal, work->place.scene_id,
                                           work->client_edit_id, &edit, &command->fault);
    if (err == BD_ERR_NOT_FOUND) return; // it only looked like it
    command->err = err;
    if (err) return;
    work->is_repeated = true;
    work->answer = bd_edit_reply_again(edit.answer.data, edit.answer.size);
}

static bool begin_new(struct bd_edit_work *work);

static void read_answer_back(struct bd_journal_turn *turn)
{
    struct bd_edit_work *work = bd_edit_work_of_turn(turn);
    struct bd_net *net = turn->net;
    if (stop_here(work)) {
        bd_edits_go_on(net);
        return;
    }
    if (work->is_repeated) {
        struct bd_answer answer = work->answer;
        work->answer = (struct bd_answer){0};
        end(work, answer);
    } else if (!begin_new(work)) {
        work->place.has_begun = false;
    }
    bd_edits_go_on(net);
}

// --- undo, redo, revert ---------------------------------------------------------------------

static void stage_read(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const struct bd_store_change change = {.scene_id = work->place.scene_id,
                                           .kind = work->kind,
                                           .of = work->of,
                                           .base_revision = work->head_revision,
                                           .client_edit_id = work->client_edit_id,
                                           .message = work->message,
                                           .delta = &work->delta};
    struct bd_batch *batch;
    command->err = bd_command_check_growth(command, work->place.scene_id, work->base, &work->delta,
                                           &command->fault);
    if (!command->err)
        command->err =
            bd_store_stage(command->net->options.store, &change, &batch, &command->fault);
    if (stop_here(work)) return;
    if (command->time_ms) batch->time_ms = command->time_ms;
    wait_for_disk(work, batch, bd_edit_reply_of_batch(batch, work));
}

static void read_delta_on_pool(struct bd_journal_turn *turn)
{
    struct bd_edit_work *work = bd_edit_work_of_turn(turn);
    work->command->err = bd_edit_work_read_past(work, turn->net->options.journal);
}

static void read_delta_back(struct bd_journal_turn *turn)
{
    struct bd_edit_work *work = bd_edit_work_of_turn(turn);
    struct bd_net *net = turn->net;
    if (!stop_here(work)) stage_read(work);
    bd_edits_go_on(net);
}

// What lies transient is the last thing that was done: it is committed before anything is taken
// back. False: wait for that, or for what else is on its way.
static bool is_settled(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    struct bd_store *store = command->net->options.store;
    struct bd_batch *batch = NULL;
    if (bd_store_is_busy(store, work->place.scene_id)) return false;
    command->err =
        bd_store_stage_commit(store, work->place.scene_id, NULL, &batch, &command->fault);
    if (command->err) return true; // ends it
    if (batch) bd_commit_soon(command->net);
    return !bd_store_is_busy(store, work->place.scene_id);
}

static bool begin_past(struct bd_edit_work *work, uint64_t base_revision)
{
    struct bd_command *command = work->command;
    const struct bd_store *store = command->net->options.store;
    const struct bd_scene *head = NULL;
    if (!is_settled(work)) return false;
    if (!command->err && work->kind != BD_BATCH_REVERT)
        command->err = bd_store_undo_target(
            store, work->place.scene_id, work->kind == BD_BATCH_REDO, &work->of, &command->fault);
    if (!command->err)
        command->err = bd_store_head(store, work->place.scene_id, &head, &work->head_revision,
                                     &command->fault);
    if (!command->err && base_revision && base_revision != work->head_revision)
        command->err = bd_fault_set(&command->fault, BD_ERR_CONFLICT, "base_revision",
                                    "the scene is at revision %" PRIu64 ", not %" PRIu64,
                                    work->head_revision, base_revision);
    if (stop_here(work)) return true;
    work->base = bd_scene_retain((struct bd_scene *)head);
    work->turn.on_pool = read_delta_on_pool;
    work->turn.back = read_delta_back;
    bd_journal_turn_take(command->net, &work->turn);
    return true;
}

static bool begin_undo(struct bd_edit_work *work)
{
    const Bounced__EditUndo *request = work->command->envelope->edit_undo;
    work->kind = request->redo ? BD_BATCH_REDO : BD_BATCH_UNDO;
    return begin_past(work, request->base_revision);
}

static bool begin_revert(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const Bounced__EditRevert *request = command->envelope->edit_revert;
    work->kind = BD_BATCH_REVERT;
    if ((request->revision != 0) == (request->name != NULL))
        command->err = bd_fault_set(&command->fault, BD_ERR_USAGE, "revision",
                                    "a revert names a revision or a name: one of them");
    if (stop_here(work)) return true;
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
    struct bd_net *net = command->net;
    BD_ASSERT_CMP(status, ==, 0);
    if (!stop_here(command->edit)) stage_read(command->edit);
    bd_edits_go_on(net);
}

static bool begin_replay(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const struct bd_scene *head = NULL;
    uint64_t revision;
    command->err = bd_store_head(command->net->options.store, work->place.scene_id, &head,
                                 &revision, &command->fault);
    if (!command->err) command->err = bd_edit_replay_check(work, revision);
    if (stop_here(work)) return true;
    work->base = bd_scene_retain((struct bd_scene *)head);
    bd_command_pool(command, read_replay_on_pool, read_replay_back);
    return true;
}

// --- commit, names --------------------------------------------------------------------------

static bool begin_commit(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    struct bd_store *store = command->net->options.store;
    struct bd_batch *batch = NULL;
    enum bd_err err = bd_store_stage_commit(store, work->place.scene_id, work->client_edit_id,
                                            &batch, &command->fault);
    if (err == BD_ERR_BUSY) return false;
    command->err = err;
    if (stop_here(work)) return true;
    if (batch) {
        wait_for_disk(work, batch, bd_edit_reply_of_batch(batch, work));
        return true;
    }
    const struct bd_store_entry *entry;
    command->err = bd_store_get(store, work->place.scene_id, &entry, &command->fault);
    if (!stop_here(work)) end(work, bd_edit_reply_of_entry(entry, work));
    return true;
}

static bool begin_name(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const Bounced__RevisionName *request = command->envelope->revision_name;
    struct bd_batch *batch = NULL;
    command->err =
        bd_store_stage_name(command->net->options.store, work->place.scene_id, request->name,
                            request->revision, request->remove, &batch, &command->fault);
    if (!stop_here(work)) wait_for_disk(work, batch, bd_answer_done());
    return true;
}

// --- the way in -----------------------------------------------------------------------------

static bool begin_new(struct bd_edit_work *work)
{
    switch (work->command->envelope->body_case) {
    case BOUNCED__ENVELOPE__BODY_EDIT_BATCH:
        return begin_batch(work);
    case BOUNCED__ENVELOPE__BODY_EDIT_UNDO:
        return begin_undo(work);
    case BOUNCED__ENVELOPE__BODY_EDIT_REVERT:
        return begin_revert(work);
    case BOUNCED__ENVELOPE__BODY_EDIT_COMMIT:
        return begin_commit(work);
    case BOUNCED__ENVELOPE__BODY_SCENE_REPLAY:
        return begin_replay(work);
    default:
        return begin_name(work);
    }
}

// An id that was used before is looked up in the journal; one that is on its way is waited for.
static bool begin(struct bd_edit_place *place)
{
    struct bd_edit_work *work = bd_edit_work_of_place(place);
    struct bd_command *command = work->command;
    uint64_t revision = 0;
    if (stop_here(work)) return true;
    if (work->client_edit_id[0] && !work->is_transient) {
        enum bd_err err = bd_store_find_edit(command->net->options.store, place->scene_id,
                                             work->client_edit_id, &revision, &command->fault);
        if (err == BD_ERR_BUSY) return false;
        command->err = err;
        if (stop_here(work)) return true;
    }
    if (revision == 0) return begin_new(work);
    work->turn.on_pool = read_answer_on_pool;
    work->turn.back = read_answer_back;
    bd_journal_turn_take(command->net, &work->turn);
    return true;
}

void bd_command_edit(struct bd_command *command)
{
    struct bd_edit_work *work = NULL;
    command->err = bd_edit_work_create(command, &work);
    command->edit = work;
    if (bd_command_stop_here(command)) return;
    work->place.begin = begin;
    work->is_queued = true;
    bd_edit_queue_join(command->net, &work->place);
}

// --- scenes ---------------------------------------------------------------------------------

static void on_scene_added(struct bd_commit_waiter *waiter, const struct bd_batch *batch,
                           enum bd_err err, const struct bd_fault *fault)
{
    struct bd_edit_work *work = (struct bd_edit_work *)waiter;
    struct bd_command *command = work->command;
    const struct bd_store_entry *entry;
    if (!err)
        err = bd_store_get(command->net->options.store, batch->scene_id, &entry, &command->fault);
    else
        command->fault = *fault;
    command->err = err;
    if (bd_command_stop_here(command)) return;
    struct bd_answer answer = bd_answer_scene(entry);
    bd_command_end(command, &answer);
}

static struct bd_edit_work *work_of_scene(struct bd_command *command)
{
    struct bd_edit_work *work = calloc(1, sizeof *work);
    BD_ASSERT(work);
    work->command = command;
    command->edit = work;
    return work;
}

void bd_command_scene_add(struct bd_command *command, const char *name)
{
    struct bd_batch *batch;
    command->err = bd_command_check_new_scene(command, name, &command->fault);
    if (bd_command_stop_here(command)) return;
    command->err = bd_store_stage_add_at(
        command->net->options.store, command->scene, name, command->grant->name,
        command->revision ? command->revision : 1, &batch, &command->fault);
    if (bd_command_stop_here(command)) return;
    if (command->time_ms) batch->time_ms = command->time_ms;
    struct bd_edit_work *work = work_of_scene(command);
    work->waiter.done = on_scene_added;
    batch->user = &work->waiter;
    bd_commit_soon(command->net);
}

void bd_command_scene_remove(struct bd_command *command)
{
    const char *id = command->envelope->scene_remove->id;
    struct bd_batch *batch;
    command->err =
        bd_store_stage_remove(command->net->options.store, id ? id : "", &batch, &command->fault);
    if (bd_command_stop_here(command)) return;
    wait_for_disk(work_of_scene(command), batch, bd_answer_done());
}

// --- quiet ----------------------------------------------------------------------------------

static void on_quiet(uv_timer_t *timer)
{
    bd_edit_commit_quiet(timer->data, false);
}

void bd_edit_watch_quiet(struct bd_net *net)
{
    net->quiet_timer.data = net;
    uv_timer_start(&net->quiet_timer, on_quiet, QUIET_NS / 1000000, 0);
}

void bd_edit_commit_quiet(struct bd_net *net, bool all)
{
    struct bd_store *store = net->options.store;
    bool ask_again = false;
    for (uint32_t i = 0; i < bd_store_count(store); i++) {
        const struct bd_store_entry *entry = bd_store_at(store, i);
        struct bd_batch *batch = NULL;
        struct bd_fault fault;
        if (entry->transient == 0) continue;
        bool is_quiet = bd_clock_ns() - entry->transient_ns >= QUIET_NS * 9 / 10;
        enum bd_err err = BD_ERR_OK;
        if (all || is_quiet) err = bd_store_stage_commit(store, entry->id, NULL, &batch, &fault);
        if (batch) bd_commit_soon(net);
        ask_again |= !is_quiet || err == BD_ERR_BUSY;
    }
    if (ask_again && !all) bd_edit_watch_quiet(net);
}
