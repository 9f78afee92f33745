// Requests that change a scene: batches here, the rest in edit_history.c. Each is answered once it
// is on the disk.

#include <inttypes.h>
#include <stdlib.h>

#include "base/assert.h"
#include "frame/invalidate.h"
#include "net/command/command_rights.h"
#include "net/command/edit_reply.h"
#include "net/command/edit_work.h"
#include "net/commit/idle_commit.h"
#include "net/wire/edit_decode.h"

// --- batches --------------------------------------------------------------------------------

static enum bd_err stage_durable(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    const Bounced__EditBatch *request = command->envelope->edit_batch;
    const struct bd_store_change change = {.scene_id = command->place.scene_id,
                                           .kind = BD_BATCH_EDIT,
                                           .base_revision = request->base_revision,
                                           .client_edit_id = request->client_edit_id,
                                           .message = request->message,
                                           .author = work->author,
                                           .delta = &work->delta};
    enum bd_err err = bd_store_stage(command->steps.loop->serving->store, &change,
                                     &command->place.batch, &command->steps.detail);
    if (!err) command->answer = bd_edit_reply_of_batch(command->place.batch, work);
    return err;
}

static enum bd_err lay_transient(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    const struct bd_store_entry *entry;
    enum bd_err err = bd_store_lay(command->steps.loop->serving->store, command->place.scene_id,
                                   work->author, &work->delta, &entry, &command->steps.detail);
    if (err) return err;
    command->answer = bd_edit_reply_of_entry(entry, work);
    bd_idle_commit_watch(command->commands->commits);
    const struct bd_live_change change = {
        .kind = "transient", .delta = &work->delta, .author = work->author};
    bd_live_changed(command->commands->live, command->place.scene_id, &change);
    return BD_ERR_OK;
}

static enum bd_err check_transient_base(const struct bd_store_entry *entry,
                                        const Bounced__EditBatch *request,
                                        struct bd_err_detail *detail)
{
    if (!request->base_revision || request->base_revision == entry->revision) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_CONFLICT, "base_revision",
                      "the scene is at revision %" PRIu64 ", not %" PRIu64, entry->revision,
                      request->base_revision);
}

// What the operations are checked against: what is shown if they lie over it, else the head.
static enum bd_err find_base(struct bd_edit_work *work, const struct bd_scene **out)
{
    struct bd_command *command = work->command;
    const struct bd_store *store = command->steps.loop->serving->store;
    const struct bd_store_entry *entry;
    uint64_t revision;
    if (!work->is_transient)
        return bd_store_head(store, command->place.scene_id, out, &revision,
                             &command->steps.detail);
    enum bd_err err = bd_store_get(store, command->place.scene_id, &entry, &command->steps.detail);
    if (!err)
        err = check_transient_base(entry, command->envelope->edit_batch, &command->steps.detail);
    if (!err) *out = entry->scene;
    return err;
}

static enum bd_err stage_batch(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    const Bounced__EditBatch *request = command->envelope->edit_batch;
    const struct bd_scene *base = NULL;
    enum bd_err err = find_base(work, &base);
    if (!err)
        err = bd_edit_check(base, work->ops, (uint32_t)work->op_count, &bd_edit_default_limits,
                            &work->delta, work->ids, &command->steps.detail);
    if (!err)
        err = bd_command_check_growth(command, command->place.scene_id, base, &work->delta,
                                      &command->steps.detail);
    if (err) return err;
    if (!request->dry_run && !work->is_transient) return stage_durable(command);
    bd_steps_finish(&command->steps); // nothing goes to the disk
    return request->dry_run ? bd_edit_dry_run(work, base) : lay_transient(command);
}

static enum bd_err read_heavy(struct bd_command *command)
{
    return bd_edit_work_read_heavy(command->edit);
}

#define STAGE_STEPS BD_STEP(loop, stage_batch), BD_STEP(disk, NULL), BD_STEPS_END

static const struct bd_step light_steps[] = {STAGE_STEPS};
// A stream of vertices is short, as a message is, and is to be seen soon; a blob may be anything.
static const struct bd_step stream_steps[] = {BD_STEP(pool, read_heavy), STAGE_STEPS};
static const struct bd_step content_steps[] = {BD_STEP_BACKGROUND(read_heavy, NULL, CONTENT),
                                               STAGE_STEPS};
static const struct bd_step files_steps[] = {BD_STEP_BACKGROUND(read_heavy, NULL, FILES),
                                             STAGE_STEPS};

static enum bd_err begin_batch(struct bd_command *command)
{
    static const struct bd_step *const by_weight[] = {
        [BD_EDIT_LIGHT] = light_steps,
        [BD_EDIT_STREAM] = stream_steps,
        [BD_EDIT_CONTENT] = content_steps,
        [BD_EDIT_FILES] = files_steps,
    };
    struct bd_edit_work *work = command->edit;
    const enum bd_edit_weight weight = bd_edit_batch_weight(command->envelope->edit_batch);
    const struct bd_scene *base = NULL;
    enum bd_err err = bd_edit_work_decode(work);
    if (!err) err = find_base(work, &base);
    if (err) return err;
    bd_steps_branch(&command->steps, by_weight[weight]);
    if (weight == BD_EDIT_LIGHT) return BD_ERR_OK;
    work->base = bd_scene_retain((struct bd_scene *)base);
    work->quota_bytes = bd_command_content_quota(command, command->place.scene_id, base);
    return BD_ERR_OK;
}

static const struct bd_step batch_steps[] = {BD_STEP(loop, begin_batch), BD_STEPS_END};

// --- a batch that was there before -----------------------------------------------------------

static enum bd_err read_answer(struct bd_command *command)
{
    struct bd_edit_work *work = command->edit;
    struct bd_journal_edit edit;
    enum bd_err err =
        bd_journal_find_edit(command->steps.loop->serving->journal, command->place.scene_id,
                             work->client_edit_id, &edit, &command->steps.detail);
    if (err == BD_ERR_NOT_FOUND) return BD_ERR_OK; // it only looked like it
    if (!err) command->answer = bd_edit_reply_again(edit.answer.data, edit.answer.size);
    return err;
}

static enum bd_err begin_unless_answered(struct bd_command *command)
{
    if (!command->answer.envelope) bd_steps_branch(&command->steps, command->row->turn_steps);
    return BD_ERR_OK;
}

static const struct bd_step again_steps[] = {BD_STEP(journal, read_answer),
                                             BD_STEP(loop, begin_unless_answered), BD_STEPS_END};

// --- the way in -----------------------------------------------------------------------------

static bool makes_revision(const struct bd_edit_work *work)
{
    const Bounced__Envelope *envelope = work->command->envelope;
    const bool is_batch = envelope->body_case == BOUNCED__ENVELOPE__BODY_EDIT_BATCH;
    return !work->is_transient && !(is_batch && envelope->edit_batch->dry_run);
}

// An id that was used before is looked up in the journal; one that is on its way is waited for.
static enum bd_err begin(struct bd_command *command)
{
    const struct bd_edit_work *work = command->edit;
    uint64_t revision = 0;
    if (makes_revision(work) && work->client_edit_id[0]) {
        enum bd_err err =
            bd_store_find_edit(command->steps.loop->serving->store, command->place.scene_id,
                               work->client_edit_id, &revision, &command->steps.detail);
        if (err == BD_ERR_BUSY) {
            bd_edit_queue_wait(&command->place);
            return BD_ERR_OK;
        }
        if (err) return err;
    }
    bd_steps_branch(&command->steps, revision == 0 ? command->row->turn_steps : again_steps);
    return BD_ERR_OK;
}

static enum bd_err read_request(struct bd_command *command)
{
    return bd_edit_work_create(command, &command->edit);
}

const struct bd_step bd_steps_edit[] = {BD_STEP(loop, read_request), BD_STEP(scene, NULL),
                                        BD_STEP(loop, begin), BD_STEPS_END};

const struct bd_command_row bd_rows_of_batches[] = {
    {BD_BODY(EDIT_BATCH), BD_OF_SCENE, .role = BD_ROLE_EDIT, .has_payload = true,
     .http = "POST /v1/scenes/ID/edits", .steps = bd_steps_edit, .turn_steps = batch_steps},
    BD_ROWS_END,
};

// --- a batch that is only tried ------------------------------------------------------------------

static void list_passes(char ***list, size_t *count, const char *const *passes, uint32_t pass_count)
{
    *list = calloc(pass_count + 1, sizeof **list);
    BD_ASSERT(*list);
    for (uint32_t i = 0; i < pass_count; i++) (*list)[(*count)++] = bd_answer_text(passes[i]);
}

static enum bd_err try(struct bd_command *command, const struct bd_scene *base,
                       const struct bd_delta *delta, struct bd_scene **after,
                       struct bd_invalidation *passes)
{
    struct bd_frame_options options = {0};
    struct bd_err_detail *detail = &command->steps.detail;
    enum bd_err err = bd_frame_options_read(command->envelope->edit_batch->frame, &options, detail);
    if (!err) err = bd_delta_apply(base, delta, after, detail);
    if (!err) err = bd_invalidate(base, *after, &options.frame, passes, detail);
    return err;
}

enum bd_err bd_edit_dry_run(struct bd_edit_work *work, const struct bd_scene *base)
{
    struct bd_command *command = work->command;
    struct bd_invalidation passes;
    struct bd_scene *after = NULL;
    enum bd_err err = try(command, base, &work->delta, &after, &passes);
    if (!err) {
        command->answer = bd_edit_reply_of_trial(after, work);
        Bounced__EditReply *reply = command->answer.envelope->edit_reply;
        list_passes(&reply->invalidates, &reply->n_invalidates, passes.run, passes.run_count);
        list_passes(&reply->keeps, &reply->n_keeps, passes.kept, passes.kept_count);
    }
    bd_scene_release(&after);
    return err;
}
