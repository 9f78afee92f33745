#include "net/command/edit_step.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/command/command_rights.h"
#include "net/command/edit_dry_run.h"
#include "net/command/edit_end.h"
#include "net/command/edit_history.h"
#include "net/command/edit_reply.h"
#include "net/command/edit_work.h"
#include "net/commit/commit.h"
#include "net/commit/idle_commit.h"
#include "net/wire/edit_decode.h"

// --- batches --------------------------------------------------------------------------------

static void stage_durable(struct bd_edit_work *work, const Bounced__EditBatch *request)
{
    struct bd_command *command = work->command;
    const struct bd_store_change change = {.scene_id = work->place.scene_id,
                                           .kind = BD_BATCH_EDIT,
                                           .base_revision = request->base_revision,
                                           .client_edit_id = request->client_edit_id,
                                           .message = request->message,
                                           .author = work->author,
                                           .delta = &work->delta};
    struct bd_batch *batch;
    command->err = bd_store_stage(command->loop->serving->store, &change, &batch, &command->fault);
    if (bd_edit_stop_here(work)) return;
    bd_edit_wait_for_disk(work, batch, bd_edit_reply_of_batch(batch, work));
}

static void lay_transient(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const struct bd_store_entry *entry;
    command->err = bd_store_lay(command->loop->serving->store, work->place.scene_id, work->author,
                                &work->delta, &entry, &command->fault);
    if (bd_edit_stop_here(work)) return;
    struct bd_answer answer = bd_edit_reply_of_entry(entry, work);
    bd_idle_commit_watch(command->commands->commits);
    const struct bd_live_change change = {
        .kind = "transient", .delta = &work->delta, .author = work->author};
    bd_live_changed(command->commands->live, work->place.scene_id, &change);
    bd_edit_end(work, answer);
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
    const struct bd_store *store = command->loop->serving->store;
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
    if (bd_edit_stop_here(work)) return;
    command->err = find_base(work, &base);
    if (!command->err)
        command->err =
            bd_edit_check(base, work->ops, (uint32_t)work->op_count, &bd_edit_default_limits,
                          &work->delta, work->ids, &command->fault);
    if (!command->err)
        command->err = bd_command_check_growth(command, work->place.scene_id, base, &work->delta,
                                               &command->fault);
    if (bd_edit_stop_here(work)) return;
    if (request->dry_run)
        bd_edit_dry_run(work, base);
    else if (work->is_transient)
        lay_transient(work);
    else
        stage_durable(work, request);
}

static void read_in_background(struct bd_background *work)
{
    struct bd_command *command = work->user;
    command->err = bd_edit_work_read_heavy(command->edit);
}

static void read_in_background_back(struct bd_background *work)
{
    struct bd_command *command = work->user;
    struct bd_commits *commits = command->commands->commits;
    command->err = bd_command_check_background(command);
    stage_batch(command->edit);
    bd_edits_go_on(commits);
}

static void begin_in_background(struct bd_command *command, enum bd_background_lane lane)
{
    command->background = (struct bd_background){
        .user = command, .lane = lane, .run = read_in_background, .back = read_in_background_back};
    bd_background_start(command->loop, &command->background);
}

static void read_stream_on_pool(uv_work_t *pool)
{
    struct bd_command *command = pool->data;
    command->err = bd_edit_work_read_heavy(command->edit);
}

static void read_stream_back(uv_work_t *pool, int status)
{
    struct bd_command *command = pool->data;
    struct bd_commits *commits = command->commands->commits;
    BD_ASSERT_CMP(status, ==, 0);
    stage_batch(command->edit);
    bd_edits_go_on(commits);
}

// A stream of vertices is short, as a message is, and is to be seen soon; a blob may be anything.
static void read_heavy(struct bd_command *command, enum bd_edit_weight weight)
{
    if (weight == BD_EDIT_STREAM)
        bd_command_pool(command, read_stream_on_pool, read_stream_back);
    else
        begin_in_background(command,
                            weight == BD_EDIT_FILES ? BD_BACKGROUND_FILES : BD_BACKGROUND_CONTENT);
}

static bool begin_batch(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const enum bd_edit_weight weight = bd_edit_batch_weight(command->envelope->edit_batch);
    const struct bd_scene *base = NULL;
    command->err = bd_edit_work_decode(work);
    if (!command->err) command->err = find_base(work, &base);
    if (bd_edit_stop_here(work)) return true;
    if (weight == BD_EDIT_LIGHT) {
        stage_batch(work);
        return true;
    }
    work->base = bd_scene_retain((struct bd_scene *)base);
    work->quota_bytes = bd_command_content_quota(command, work->place.scene_id, base);
    read_heavy(command, weight);
    return true;
}

// --- a batch that was there before -----------------------------------------------------------

static void read_answer_on_pool(struct bd_journal_turn *turn)
{
    struct bd_edit_work *work = bd_edit_work_of_turn(turn);
    struct bd_command *command = work->command;
    struct bd_journal_edit edit;
    work->is_repeated = false;
    enum bd_err err =
        bd_journal_find_edit(turn->commits->loop->serving->journal, work->place.scene_id,
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
    struct bd_commits *commits = turn->commits;
    if (bd_edit_stop_here(work)) {
        bd_edits_go_on(commits);
        return;
    }
    if (work->is_repeated) {
        struct bd_answer answer = work->answer;
        work->answer = (struct bd_answer){0};
        bd_edit_end(work, answer);
    } else if (!begin_new(work)) {
        work->place.has_begun = false;
    }
    bd_edits_go_on(commits);
}

// --- the way in -----------------------------------------------------------------------------

static bool begin_new(struct bd_edit_work *work)
{
    switch (work->command->envelope->body_case) {
    case BOUNCED__ENVELOPE__BODY_EDIT_BATCH:
        return begin_batch(work);
    case BOUNCED__ENVELOPE__BODY_EDIT_UNDO:
        return bd_edit_begin_undo(work);
    case BOUNCED__ENVELOPE__BODY_EDIT_REVERT:
        return bd_edit_begin_revert(work);
    case BOUNCED__ENVELOPE__BODY_EDIT_COMMIT:
        return bd_edit_begin_commit(work);
    case BOUNCED__ENVELOPE__BODY_SCENE_REPLAY:
        return bd_edit_begin_replay(work);
    default:
        return bd_edit_begin_name(work);
    }
}

static bool makes_revision(const struct bd_edit_work *work)
{
    const Bounced__Envelope *envelope = work->command->envelope;
    const bool is_batch = envelope->body_case == BOUNCED__ENVELOPE__BODY_EDIT_BATCH;
    return !work->is_transient && !(is_batch && envelope->edit_batch->dry_run);
}

// An id that was used before is looked up in the journal; one that is on its way is waited for.
static bool begin(struct bd_edit_place *place)
{
    struct bd_edit_work *work = bd_edit_work_of_place(place);
    struct bd_command *command = work->command;
    uint64_t revision = 0;
    if (bd_edit_stop_here(work)) return true;
    if (makes_revision(work) && work->client_edit_id[0]) {
        enum bd_err err = bd_store_find_edit(command->loop->serving->store, place->scene_id,
                                             work->client_edit_id, &revision, &command->fault);
        if (err == BD_ERR_BUSY) return false;
        command->err = err;
        if (bd_edit_stop_here(work)) return true;
    }
    if (revision == 0) return begin_new(work);
    work->turn.on_pool = read_answer_on_pool;
    work->turn.back = read_answer_back;
    bd_journal_turn_take(command->commands->commits, &work->turn);
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
    bd_edit_queue_join(command->commands->commits, &work->place);
}
