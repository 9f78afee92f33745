#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "base/log.h"
#include "scene/derive.h"
#include "scene/store_parts.h"

// Objects of one scene that can lie transient at once: each may hold a mesh.
#define TRANSIENT_OBJECTS_MAX 4096

// --- what is shown --------------------------------------------------------------------------

static void show(struct bd_slot *slot, struct bd_scene *scene)
{
    bd_scene_retain(scene);
    bd_scene_release(&slot->shown.scene);
    slot->shown.scene = scene;
    slot->shown.transient = slot->overlay_batches + slot->committing_batches;
}

static void drop_transient(struct bd_slot *slot)
{
    bd_delta_finish(&slot->overlay);
    bd_delta_finish(&slot->committing);
    slot->overlay_batches = slot->committing_batches = 0;
}

static enum bd_err apply_over(const struct bd_delta *delta, struct bd_scene **scene,
                              struct bd_fault *fault)
{
    if (delta->count == 0) return BD_ERR_OK;
    struct bd_scene *next = NULL;
    enum bd_err err = bd_delta_apply(*scene, delta, &next, fault);
    if (err) return err;
    bd_scene_release(scene);
    *scene = next;
    return BD_ERR_OK;
}

static void drop_with_warning(struct bd_slot *slot, const char *reason)
{
    bd_log(BD_LOG_WARN, "scene", "%s: transient changes dropped: %s", slot->shown.id, reason);
    drop_transient(slot);
}

// Durable, with what lies over it; without that if it has lost its meaning.
static void show_again(struct bd_slot *slot)
{
    struct bd_fault fault = {0};
    struct bd_scene *scene = bd_scene_retain(slot->durable);
    enum bd_err err = apply_over(&slot->committing, &scene, &fault);
    if (!err) err = apply_over(&slot->overlay, &scene, &fault);
    if (err) {
        drop_with_warning(slot, fault.message);
        bd_scene_release(&scene);
        scene = bd_scene_retain(slot->durable);
    }
    show(slot, scene);
    bd_scene_release(&scene);
}

// Gives `*scene` the slots that `other` has more, empty: no hash knows them. False without memory.
static bool keep_slots(struct bd_scene **scene, const struct bd_scene *other)
{
    struct bd_scene_counts has = bd_scene_slots(*scene), wants = bd_scene_slots(other);
    struct bd_delta empty = {0};
    bool ok = true;
    for (int k = 0; ok && k < BD_OBJECT_ENVIRONMENT; k++) {
        enum bd_object_kind kind = (enum bd_object_kind)k;
        uint32_t count = *bd_slots_of(&wants, kind);
        if (count > *bd_slots_of(&has, kind)) ok = bd_delta_take(&empty, *scene, kind, count - 1);
    }
    ok = ok && apply_over(&empty, scene, NULL) == BD_ERR_OK;
    bd_delta_finish(&empty);
    return ok;
}

// False, and nothing changed, without memory.
static bool merge_into(struct bd_delta *below, const struct bd_delta *above)
{
    struct bd_delta merged = {0};
    if (!bd_delta_merge(below, above, &merged)) return false;
    bd_delta_finish(below);
    *below = merged;
    return true;
}

static enum bd_err check_overlay(const struct bd_slot *slot, const struct bd_delta *delta,
                                 struct bd_fault *fault)
{
    if (slot->overlay.count + (uint64_t)delta->count <= TRANSIENT_OBJECTS_MAX) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_LIMIT, "transient_objects",
                        "more than %d objects would be transient at once: commit first",
                        TRANSIENT_OBJECTS_MAX);
}

// What is shown knows nothing of the objects that a batch on its way to the disk adds.
static enum bd_err check_ids(const struct bd_slot *slot, const struct bd_delta *delta,
                             struct bd_fault *fault)
{
    struct bd_scene_counts shown = bd_scene_slots(slot->shown.scene);
    struct bd_scene_counts head = bd_scene_slots(slot->head);
    for (uint32_t i = 0; slot->staged_count > 0 && i < delta->count; i++) {
        const struct bd_change *change = &delta->changes[i];
        const uint32_t *count = bd_slots_of(&shown, change->kind);
        if (count && change->id >= *count && change->id < *bd_slots_of(&head, change->kind))
            return bd_fault_set(fault, BD_ERR_BUSY, "ops",
                                "an edit on its way to the disk adds %s %u: ask again",
                                bd_object_kind_name(change->kind), change->id);
    }
    return BD_ERR_OK;
}

// The ids of what is added are given to nothing else, whatever becomes of it.
static bool lay_over(struct bd_slot *slot, const struct bd_delta *delta,
                     const struct bd_scene *shown)
{
    return keep_slots(&slot->durable, shown) && keep_slots(&slot->head, shown) &&
           merge_into(&slot->overlay, delta);
}

enum bd_err bd_store_lay(struct bd_store *store, const char *id, const struct bd_delta *delta,
                         const struct bd_store_entry **out, struct bd_fault *fault)
{
    struct bd_slot *slot = bd_slot_get(store, id, fault);
    if (!slot) return BD_ERR_NOT_FOUND;
    enum bd_err err = check_overlay(slot, delta, fault);
    if (!err) err = check_ids(slot, delta, fault);
    if (err) return err;
    struct bd_scene *scene = bd_scene_retain(slot->shown.scene);
    err = apply_over(delta, &scene, fault);
    if (!err && !lay_over(slot, delta, scene))
        err = bd_fault_set(fault, BD_ERR_NO_MEMORY, "", "no memory for the edit");
    if (!err) {
        slot->overlay_batches++;
        slot->shown.transient_ns = bd_clock_ns();
        show(slot, scene);
        *out = &slot->shown;
    }
    bd_scene_release(&scene);
    return err;
}

// The overlay goes beneath: to the batch, and to what is shown until it is published.
static void begin_commit(struct bd_slot *slot, struct bd_batch *batch)
{
    bool merged = merge_into(&slot->committing, &batch->forward);
    BD_ASSERT(merged);
    slot->committing_count++;
    slot->committing_batches += slot->overlay_batches;
    slot->overlay_batches = 0;
    slot->overlay = (struct bd_delta){0};
    batch->was_transient = true;
}

enum bd_err bd_store_stage_commit(struct bd_store *store, const char *id,
                                  const char *client_edit_id, struct bd_batch **out,
                                  struct bd_fault *fault)
{
    struct bd_slot *slot = bd_slot_get(store, id, fault);
    *out = NULL;
    if (!slot) return BD_ERR_NOT_FOUND;
    if (slot->overlay.count == 0) return BD_ERR_OK;
    // What lies there knows nothing of what is on its way: it would take that back.
    if (slot->staged_count > 0)
        return bd_fault_set(fault, BD_ERR_BUSY, "commit",
                            "an edit of this scene is on its way to the disk");
    struct bd_batch *batch = bd_slot_new_batch(BD_BATCH_EDIT, slot);
    bd_batch_set_text(batch->client_edit_id, sizeof batch->client_edit_id, client_edit_id);
    batch->forward = slot->overlay;
    enum bd_err err = bd_slot_apply(slot, batch, fault);
    if (err) {
        batch->forward = (struct bd_delta){0};
        bd_batch_free(&batch);
        return err;
    }
    begin_commit(slot, batch);
    bd_slot_stage(store, slot, batch);
    *out = batch;
    return BD_ERR_OK;
}

// --- published or failed --------------------------------------------------------------------

static void leave_flight(struct bd_store *store, struct bd_slot *slot, const struct bd_batch *batch)
{
    uint32_t i = 0;
    while (store->in_flight[i] != batch) i++;
    memmove(store->in_flight + i, store->in_flight + i + 1,
            (--store->in_flight_count - i) * sizeof *store->in_flight);
    BD_ASSERT_CMP(slot->staged_count, >, 0);
    slot->staged_count--;
}

static void end_commit(struct bd_slot *slot)
{
    if (--slot->committing_count > 0) return;
    bd_delta_finish(&slot->committing);
    slot->committing_batches = 0;
}

// Whether it fills a slot that what lies there has filled too: an undo or a replay comes with ids.
static bool means_another(const struct bd_slot *slot, const struct bd_batch *batch)
{
    for (uint32_t i = 0; i < slot->overlay.count; i++) {
        const struct bd_change *over = &slot->overlay.changes[i];
        const struct bd_change *before = bd_delta_get(&batch->inverse, over->kind, over->id);
        if (before && bd_change_is_removal(before)) return true;
    }
    return false;
}

// What a durable batch says of an object is newer than what lies over it. The states of the rest
// are those that are shown still.
static void forget_touched(struct bd_slot *slot, const struct bd_delta *delta)
{
    struct bd_delta kept = {0};
    bool ok = true;
    for (uint32_t i = 0; ok && i < slot->overlay.count; i++) {
        const struct bd_change *change = &slot->overlay.changes[i];
        if (!bd_delta_get(delta, change->kind, change->id))
            ok = bd_delta_take(&kept, slot->shown.scene, change->kind, change->id);
    }
    bd_delta_finish(&slot->overlay);
    slot->overlay = kept;
    if (!ok)
        drop_transient(slot);
    else if (kept.count == 0)
        slot->overlay_batches = 0;
}

static void publish_revision(struct bd_slot *slot, const struct bd_batch *batch)
{
    struct bd_scene *before = slot->durable;
    slot->durable = bd_scene_retain(batch->after);
    if (before) (void)keep_slots(&slot->durable, before); // of what was laid since it was staged
    bd_scene_release(&before);
    slot->shown.revision = batch->revision;
    slot->is_listed = true;
    if (batch->was_transient)
        end_commit(slot);
    else if (means_another(slot, batch))
        drop_with_warning(slot, "their ids are those of other objects now");
    else
        forget_touched(slot, &batch->forward);
    struct bd_store_past past = {batch->revision, batch->of, batch->kind, ""};
    memcpy(past.client_edit_id, batch->client_edit_id, sizeof past.client_edit_id);
    bd_history_add(&slot->history, &past);
    show_again(slot);
}

void bd_store_publish(struct bd_store *store, struct bd_batch *batch)
{
    struct bd_slot *slot = bd_slot_find(store, batch->scene_id);
    BD_ASSERT(slot);
    leave_flight(store, slot, batch);
    if (batch->kind == BD_BATCH_REMOVE)
        bd_slot_drop(store, slot);
    else if (batch->after)
        publish_revision(slot, batch);
}

static void fail_commit(struct bd_slot *slot)
{
    if (--slot->committing_count > 0) return;
    if (!merge_into(&slot->committing, &slot->overlay)) return;
    bd_delta_finish(&slot->overlay);
    slot->overlay = slot->committing;
    slot->committing = (struct bd_delta){0};
    slot->overlay_batches += slot->committing_batches;
    slot->committing_batches = 0;
}

void bd_store_fail(struct bd_store *store, struct bd_batch *batch)
{
    struct bd_slot *slot = bd_slot_find(store, batch->scene_id);
    BD_ASSERT(slot);
    leave_flight(store, slot, batch);
    if (batch->was_transient) fail_commit(slot);
    if (batch->kind == BD_BATCH_REMOVE) slot->is_leaving = false;
    if (batch->kind == BD_BATCH_ADD)
        bd_slot_drop(store, slot);
    else if (batch->after) // a name that could not be given leaves the edits beside it alone
        bd_slot_set_head(slot, slot->durable, slot->shown.revision);
}
