#include "net/command/edit_work.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/access/auth.h"
#include "net/access/author.h"
#include "net/command/revision_name.h"
#include "net/loop/release.h"
#include "net/wire/edit_decode.h"

// --- what every such request has --------------------------------------------------------------

static enum bd_err take_text(const char *field, const char *from, char *to, size_t size,
                             struct bd_err_detail *detail)
{
    if (from && strlen(from) >= size)
        return bd_err_set(detail, BD_ERR_LIMIT, field, "%s has at most %zu bytes", field, size - 1);
    snprintf(to, size, "%s", from ? from : "");
    return BD_ERR_OK;
}

static enum bd_err check_message(const char *text, struct bd_err_detail *detail)
{
    char message[BD_EDIT_MESSAGE_BYTES];
    return take_text("message", text, message, sizeof message, detail);
}

static enum bd_err check_batch(struct bd_edit_work *work, const Bounced__EditBatch *batch,
                               struct bd_err_detail *detail)
{
    const char *durability = batch->durability ? batch->durability : "durable";
    work->is_transient = strcmp(durability, "transient") == 0;
    if (!work->is_transient && strcmp(durability, "durable") != 0)
        return bd_err_set(detail, BD_ERR_USAGE, "durability",
                          "durability is durable or transient, not \"%.32s\"", durability);
    if (batch->n_ops == 0)
        return bd_err_set(detail, BD_ERR_USAGE, "ops", "a batch has at least one operation");
    if (batch->n_ops > bd_edit_default_limits.ops)
        return bd_err_set(detail, BD_ERR_LIMIT, "ops", "a batch has at most %" PRIu32 " operations",
                          bd_edit_default_limits.ops);
    return BD_ERR_OK;
}

// What is played from a journal was somebody's before; all else is whoever's asks, or of whom that
// one says that it is by.
static enum bd_err find_author(struct bd_edit_work *work, struct bd_err_detail *detail)
{
    const struct bd_command *command = work->command;
    const char *author = bd_command_text(command, "author"), *by = bd_command_text(command, "by");
    if (command->envelope->body_case == BOUNCED__ENVELOPE__BODY_SCENE_REPLAY)
        return bd_author_take(author, work->author, detail);
    return bd_author_make(command->grant, command->client, by, work->author, detail);
}

static enum bd_err take_scene(struct bd_edit_work *work, const char *scene,
                              struct bd_err_detail *detail)
{
    struct bd_edit_place *place = &work->command->place;
    if (!scene) return bd_err_set(detail, BD_ERR_USAGE, "scene", "an edit names its scene");
    if (strlen(scene) >= sizeof place->scene_id)
        return bd_err_set(detail, BD_ERR_NOT_FOUND, "scene", "there is no scene \"%.32s\"", scene);
    snprintf(place->scene_id, sizeof place->scene_id, "%s", scene);
    return BD_ERR_OK;
}

enum bd_err bd_edit_work_create(struct bd_command *command, struct bd_edit_work **out)
{
    const Bounced__Envelope *envelope = command->envelope;
    struct bd_err_detail *detail = &command->steps.detail;
    struct bd_edit_work *work = calloc(1, sizeof *work);
    BD_ASSERT(work);
    work->command = command;
    *out = work;
    enum bd_err err = take_scene(work, bd_command_text(command, "scene"), detail);
    if (!err)
        err = take_text("client_edit_id", bd_command_text(command, "client_edit_id"),
                        work->client_edit_id, sizeof work->client_edit_id, detail);
    if (!err) err = find_author(work, detail);
    if (!err && envelope->body_case == BOUNCED__ENVELOPE__BODY_EDIT_BATCH)
        err = check_batch(work, envelope->edit_batch, detail);
    if (!err) err = check_message(bd_command_text(command, "message"), detail);
    return err;
}

static void release_op(struct bd_loop *loop, struct bd_edit_op *op)
{
    if (op->kind == BD_EDIT_IMPORT) {
        struct bd_scene *scene = (struct bd_scene *)op->import.scene;
        op->import.scene = NULL;
        bd_release_scene(loop, &scene);
    }
    bd_edit_heavy_release(op);
}

void bd_edit_work_destroy(struct bd_edit_work **work)
{
    struct bd_edit_work *gone = *work;
    if (!gone) return;
    struct bd_loop *loop = gone->command->steps.loop;
    for (size_t i = 0; i < gone->op_count; i++) release_op(loop, &gone->ops[i]);
    free(gone->ops);
    free(gone->ids);
    bd_release_scene(loop, &gone->base);
    bd_delta_finish(&gone->delta);
    free(gone);
    *work = NULL;
}

// --- a batch --------------------------------------------------------------------------------

enum bd_err bd_edit_work_decode(struct bd_edit_work *work)
{
    const Bounced__EditBatch *batch = work->command->envelope->edit_batch;
    BD_ASSERT(!work->ops);
    work->ops = calloc(batch->n_ops, sizeof *work->ops);
    work->ids = calloc(batch->n_ops, sizeof *work->ids);
    BD_ASSERT(work->ops && work->ids);
    for (size_t i = 0; i < batch->n_ops; i++) {
        work->op_count = i + 1; // released whatever comes of it
        enum bd_err err =
            bd_edit_decode(i, batch->ops[i], &work->ops[i], &work->command->steps.detail);
        if (err) return err;
    }
    return BD_ERR_OK;
}

enum bd_err bd_edit_work_read_heavy(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const Bounced__EditBatch *batch = command->envelope->edit_batch;
    const struct bd_serving *serving = command->steps.loop->serving;
    struct bd_edit_budget budget = bd_edit_budget(&serving->limits, work->quota_bytes);
    const struct bd_edit_heavy_inputs inputs = {
        .blobs = bd_grant_blobs(command->steps.loop->serving->blobs, command->grant),
        .limits = &serving->limits,
        .budget = &budget,
        .import_pool = command->commands->import_pool,
        .base = work->base,
        .payload = command->payload,
        .payload_bytes = command->payload_bytes};
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && !atomic_load(&command->steps.cancelled) && i < batch->n_ops; i++)
        err = bd_edit_heavy_read(&inputs, i, batch->ops[i], work->ops, &work->flags,
                                 &command->steps.detail);
    return err;
}

// --- the past -------------------------------------------------------------------------------

static enum bd_err read_revert(struct bd_edit_work *work, struct bd_journal *journal)
{
    struct bd_err_detail *detail = &work->command->steps.detail;
    const char *name = work->command->envelope->edit_revert->name;
    struct bd_scene *target = NULL;
    enum bd_err err = BD_ERR_OK;
    if (name)
        err =
            bd_revision_find_name(journal, work->command->place.scene_id, name, &work->of, detail);
    if (!err)
        err = bd_store_read_revision(journal, work->command->place.scene_id, work->of, &target,
                                     detail);
    if (!err && !bd_delta_between(work->base, target, &work->delta))
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the edit");
    bd_scene_release(&target);
    return err;
}

// So many revisions are looked through for who it was: each is read with its content.
#define CULPRITS_MAX 64

// The newest revision after the one that is to be taken back that changed the same; 0 if it is not
// among the newest, or nobody waits for the answer any more.
static enum bd_err find_culprit(struct bd_edit_work *work, struct bd_journal *journal,
                                const struct bd_clash *clash, uint64_t *revision,
                                char author[BD_EDIT_AUTHOR_BYTES])
{
    enum bd_err err = BD_ERR_OK;
    bool is_it = false;
    const uint64_t head = work->head_revision;
    for (*revision = head; !err && *revision > work->of; --*revision) {
        struct bd_store_step step;
        if (head - *revision == CULPRITS_MAX || atomic_load(&work->command->steps.cancelled)) break;
        err = bd_store_read_step(journal, work->command->place.scene_id, *revision, work->base,
                                 &step, &work->command->steps.detail);
        if (err) break;
        is_it = bd_delta_touches(&step.inverse, &step.forward, clash);
        snprintf(author, BD_EDIT_AUTHOR_BYTES, "%s", step.author);
        bd_store_step_finish(&step);
        if (is_it) break;
    }
    if (!is_it) *revision = 0;
    return err;
}

static enum bd_err refuse_clash(struct bd_edit_work *work, struct bd_journal *journal,
                                const struct bd_clash *clash)
{
    const char *word = work->kind == BD_BATCH_REDO ? "redo" : "undo";
    const char *kind = bd_object_kind_name(clash->kind);
    char author[BD_EDIT_AUTHOR_BYTES] = "", what[96] = "";
    uint64_t revision = 0;
    enum bd_err err = find_culprit(work, journal, clash, &revision, author);
    if (err) return err;
    if (clash->property[0]) snprintf(what, sizeof what, "%s of ", clash->property);
    if (revision == 0)
        return bd_err_set(&work->command->steps.detail, BD_ERR_CONFLICT, word,
                          "%s%s %" PRIu32 " was changed since, long ago: nothing was taken back; "
                          "the scope \"all\" takes back whatever was last",
                          what, kind, clash->id);
    return bd_err_set(&work->command->steps.detail, BD_ERR_CONFLICT, word,
                      "%s%s %" PRIu32 " was changed since by %.80s (revision %" PRIu64
                      "): nothing was taken back; the scope \"all\" takes back whatever was last",
                      what, kind, clash->id, author[0] ? author : "somebody unknown", revision);
}

// What the revision did is taken back from what became of it: others may have changed other
// properties of the same objects since.
static enum bd_err read_undo(struct bd_edit_work *work, struct bd_journal *journal)
{
    struct bd_err_detail *detail = &work->command->steps.detail;
    struct bd_store_step step;
    struct bd_clash clash = {0};
    enum bd_err err = bd_store_read_step(journal, work->command->place.scene_id, work->of,
                                         work->base, &step, detail);
    if (err) return err;
    if (!bd_delta_carry(work->base, &step.forward, &step.inverse, &work->delta, &clash))
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the edit");
    bd_store_step_finish(&step);
    if (err || !work->is_mine || !clash.is_there) return err;
    return refuse_clash(work, journal, &clash);
}

enum bd_err bd_edit_work_read_past(struct bd_edit_work *work, struct bd_journal *journal)
{
    return work->kind == BD_BATCH_REVERT ? read_revert(work, journal) : read_undo(work, journal);
}
