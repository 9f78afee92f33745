#include "net/edit_work.h"

#include <inttypes.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/edit_decode.h"
#include "net/release.h"
#include "net/revision_name.h"

#define CONTAINER(pointer, type, member) ((type *)((char *)(pointer)-offsetof(type, member)))

struct bd_edit_work *bd_edit_work_of_place(struct bd_edit_place *place)
{
    return CONTAINER(place, struct bd_edit_work, place);
}

struct bd_edit_work *bd_edit_work_of_turn(struct bd_journal_turn *turn)
{
    return CONTAINER(turn, struct bd_edit_work, turn);
}

// --- what every such request has --------------------------------------------------------------

struct request {
    const char *scene, *client_edit_id;
};

static struct request request_of(const Bounced__Envelope *envelope)
{
    switch (envelope->body_case) {
    case BOUNCED__ENVELOPE__BODY_EDIT_BATCH:
        return (struct request){envelope->edit_batch->scene, envelope->edit_batch->client_edit_id};
    case BOUNCED__ENVELOPE__BODY_EDIT_UNDO:
        return (struct request){envelope->edit_undo->scene, envelope->edit_undo->client_edit_id};
    case BOUNCED__ENVELOPE__BODY_EDIT_REVERT:
        return (struct request){envelope->edit_revert->scene,
                                envelope->edit_revert->client_edit_id};
    case BOUNCED__ENVELOPE__BODY_EDIT_COMMIT:
        return (struct request){envelope->edit_commit->scene,
                                envelope->edit_commit->client_edit_id};
    case BOUNCED__ENVELOPE__BODY_SCENE_REPLAY:
        return (struct request){envelope->scene_replay->scene,
                                envelope->scene_replay->client_edit_id};
    default:
        return (struct request){envelope->revision_name->scene, NULL};
    }
}

static enum bd_err take_text(const char *field, const char *from, char *to, size_t size,
                             struct bd_fault *fault)
{
    if (from && strlen(from) >= size)
        return bd_fault_set(fault, BD_ERR_LIMIT, field, "%s has at most %zu bytes", field,
                            size - 1);
    snprintf(to, size, "%s", from ? from : "");
    return BD_ERR_OK;
}

static enum bd_err check_message(const char *text, struct bd_fault *fault)
{
    char message[BD_EDIT_MESSAGE_BYTES];
    return take_text("message", text, message, sizeof message, fault);
}

static enum bd_err check_batch(struct bd_edit_work *work, const Bounced__EditBatch *batch,
                               struct bd_fault *fault)
{
    const char *durability = batch->durability ? batch->durability : "durable";
    work->is_transient = strcmp(durability, "transient") == 0;
    if (!work->is_transient && strcmp(durability, "durable") != 0)
        return bd_fault_set(fault, BD_ERR_USAGE, "durability",
                            "durability is durable or transient, not \"%.32s\"", durability);
    if (batch->n_ops == 0)
        return bd_fault_set(fault, BD_ERR_USAGE, "ops", "a batch has at least one operation");
    if (batch->n_ops > bd_edit_default_limits.ops)
        return bd_fault_set(fault, BD_ERR_LIMIT, "ops",
                            "a batch has at most %" PRIu32 " operations",
                            bd_edit_default_limits.ops);
    return check_message(batch->message, fault);
}

enum bd_err bd_edit_work_create(struct bd_command *command, struct bd_edit_work **out)
{
    const Bounced__Envelope *envelope = command->envelope;
    const struct request request = request_of(envelope);
    struct bd_fault *fault = &command->fault;
    struct bd_edit_work *work = calloc(1, sizeof *work);
    BD_ASSERT(work);
    work->command = command;
    *out = work;
    if (!request.scene)
        return bd_fault_set(fault, BD_ERR_USAGE, "scene", "an edit names its scene");
    if (strlen(request.scene) >= sizeof work->place.scene_id)
        return bd_fault_set(fault, BD_ERR_NOT_FOUND, "scene", "there is no scene \"%.32s\"",
                            request.scene);
    snprintf(work->place.scene_id, sizeof work->place.scene_id, "%s", request.scene);
    enum bd_err err = take_text("client_edit_id", request.client_edit_id, work->client_edit_id,
                                sizeof work->client_edit_id, fault);
    if (!err && envelope->body_case == BOUNCED__ENVELOPE__BODY_EDIT_BATCH)
        err = check_batch(work, envelope->edit_batch, fault);
    if (!err && envelope->body_case == BOUNCED__ENVELOPE__BODY_SCENE_REPLAY)
        err = check_message(envelope->scene_replay->message, fault);
    return err;
}

static void release_op(struct bd_net *net, struct bd_edit_op *op)
{
    if (op->kind == BD_EDIT_IMPORT) {
        struct bd_scene *scene = (struct bd_scene *)op->import.scene;
        op->import.scene = NULL;
        bd_net_release_scene(net, &scene);
    }
    bd_edit_heavy_release(op);
}

void bd_edit_work_destroy(struct bd_edit_work **work)
{
    struct bd_edit_work *gone = *work;
    if (!gone) return;
    struct bd_net *net = gone->command->net;
    for (size_t i = 0; i < gone->op_count; i++) release_op(net, &gone->ops[i]);
    free(gone->ops);
    free(gone->ids);
    bd_net_release_scene(net, &gone->base);
    bd_delta_finish(&gone->delta);
    bd_answer_finish(&gone->answer);
    free(gone);
    *work = NULL;
}

void bd_edit_work_leave(struct bd_edit_work *work)
{
    if (!work->is_queued) return;
    work->is_queued = false;
    bd_edit_queue_leave(work->command->net, &work->place);
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
        enum bd_err err = bd_edit_decode(i, batch->ops[i], &work->ops[i], &work->command->fault);
        if (err) return err;
        work->op_count = i + 1;
    }
    return BD_ERR_OK;
}

enum bd_err bd_edit_work_read_heavy(struct bd_edit_work *work)
{
    struct bd_command *command = work->command;
    const Bounced__EditBatch *batch = command->envelope->edit_batch;
    const struct bd_net_options *options = &command->net->options;
    struct bd_edit_budget budget = bd_edit_budget(&options->limits, work->quota_bytes);
    const struct bd_edit_heavy_inputs inputs = {.blobs = options->blobs,
                                                .limits = &options->limits,
                                                .budget = &budget,
                                                .import_program = options->import_program,
                                                .base = work->base,
                                                .payload = command->payload,
                                                .payload_bytes = command->payload_bytes};
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && !atomic_load(&command->cancelled) && i < batch->n_ops; i++)
        err =
            bd_edit_heavy_read(&inputs, i, batch->ops[i], work->ops, &work->flags, &command->fault);
    return err;
}

// --- the past -------------------------------------------------------------------------------

static enum bd_err read_revert(struct bd_edit_work *work, struct bd_journal *journal)
{
    struct bd_fault *fault = &work->command->fault;
    const char *name = work->command->envelope->edit_revert->name;
    struct bd_scene *target = NULL;
    enum bd_err err = BD_ERR_OK;
    if (name) err = bd_revision_find_name(journal, work->place.scene_id, name, &work->of, fault);
    if (!err) err = bd_store_read_revision(journal, work->place.scene_id, work->of, &target, fault);
    if (!err && !bd_delta_between(work->base, target, &work->delta))
        err = bd_fault_set(fault, BD_ERR_NO_MEMORY, "", "no memory for the edit");
    bd_scene_release(&target);
    return err;
}

enum bd_err bd_edit_work_read_past(struct bd_edit_work *work, struct bd_journal *journal)
{
    if (work->kind == BD_BATCH_REVERT) return read_revert(work, journal);
    return bd_store_read_inverse(journal, work->place.scene_id, work->of, &work->delta,
                                 &work->command->fault);
}
