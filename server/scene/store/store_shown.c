// What is shown of a scene: its last revision, and what lies over it for the moment.

#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "scene/model/derive.h"
#include "scene/store/store_parts.h"

// Objects of one scene that can lie transient at once: each may hold a mesh.
#define TRANSIENT_OBJECTS_MAX 4096

// --- what is shown --------------------------------------------------------------------------

static void count_transient(struct bd_slot *slot)
{
    const struct bd_layer *longest = bd_layers_find(slot, NULL);
    slot->shown.transient = bd_layers_batches(slot);
    slot->shown.transient_ns = longest ? longest->laid_ns : 0;
}

static void show(struct bd_slot *slot, struct bd_scene *scene)
{
    bd_scene_retain(scene);
    bd_scene_release(&slot->shown.scene);
    slot->shown.scene = scene;
    count_transient(slot);
}

static enum bd_err apply_over(const struct bd_delta *delta, struct bd_scene **scene,
                              struct bd_err_detail *detail)
{
    if (delta->count == 0) return BD_ERR_OK;
    struct bd_scene *next = NULL;
    enum bd_err err = bd_delta_apply(*scene, delta, &next, detail);
    if (err) return err;
    bd_scene_release(scene);
    *scene = next;
    return BD_ERR_OK;
}

static void drop_with_warning(struct bd_slot *slot, const char *reason)
{
    bd_log(BD_LOG_WARN, "scene", "%s: transient changes dropped: %s", slot->shown.id, reason);
    bd_layers_drop(slot);
}

// Durable, with what lies over it; without that if it has lost its meaning.
static void show_again(struct bd_slot *slot)
{
    struct bd_err_detail detail = {0};
    struct bd_scene *scene = bd_scene_retain(slot->durable);
    struct bd_delta over = {0};
    enum bd_err err = bd_layers_over(slot, scene, &over)
                          ? apply_over(&over, &scene, &detail)
                          : bd_err_set(&detail, BD_ERR_NO_MEMORY, "", "no memory for them");
    bd_delta_finish(&over);
    if (err) {
        drop_with_warning(slot, detail.message);
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

static enum bd_err check_overlay(const struct bd_slot *slot, const struct bd_delta *delta,
                                 struct bd_err_detail *detail)
{
    if (bd_layers_objects(slot) + (uint64_t)delta->count <= TRANSIENT_OBJECTS_MAX) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, "transient_objects",
                      "more than %d objects would be transient at once: commit first",
                      TRANSIENT_OBJECTS_MAX);
}

// What is shown knows nothing of the objects that a batch on its way to the disk adds.
static enum bd_err check_ids(const struct bd_slot *slot, const struct bd_delta *delta,
                             struct bd_err_detail *detail)
{
    struct bd_scene_counts shown = bd_scene_slots(slot->shown.scene);
    struct bd_scene_counts head = bd_scene_slots(slot->head);
    for (uint32_t i = 0; slot->staged_count > 0 && i < delta->count; i++) {
        const struct bd_change *change = &delta->changes[i];
        const uint32_t *count = bd_slots_of(&shown, change->kind);
        if (count && change->id >= *count && change->id < *bd_slots_of(&head, change->kind))
            return bd_err_set(detail, BD_ERR_BUSY, "ops",
                              "an edit on its way to the disk adds %s %u: ask again",
                              bd_object_kind_name(change->kind), change->id);
    }
    return BD_ERR_OK;
}

// The ids of what is added are given to nothing else, whatever becomes of it.
static bool lay_over(struct bd_slot *slot, const char *author, const struct bd_delta *delta,
                     const struct bd_scene *shown)
{
    return keep_slots(&slot->durable, shown) && keep_slots(&slot->head, shown) &&
           bd_layers_add(slot, author, delta);
}

enum bd_err bd_store_lay(struct bd_store *store, const char *id, const char *author,
                         const struct bd_delta *delta, const struct bd_store_entry **out,
                         struct bd_err_detail *detail)
{
    struct bd_slot *slot = bd_slot_get(store, id, detail);
    if (!slot) return BD_ERR_NOT_FOUND;
    enum bd_err err = check_overlay(slot, delta, detail);
    if (!err) err = check_ids(slot, delta, detail);
    if (err) return err;
    struct bd_scene *scene = bd_scene_retain(slot->shown.scene);
    err = apply_over(delta, &scene, detail);
    if (!err && !lay_over(slot, author ? author : "", delta, scene))
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the edit");
    if (!err) {
        show(slot, scene);
        *out = &slot->shown;
    }
    bd_scene_release(&scene);
    return err;
}

enum bd_err bd_store_stage_commit(struct bd_store *store, const char *id, const char *author,
                                  const char *client_edit_id, struct bd_batch **out,
                                  struct bd_err_detail *detail)
{
    struct bd_slot *slot = bd_slot_get(store, id, detail);
    *out = NULL;
    if (!slot) return BD_ERR_NOT_FOUND;
    struct bd_layer *layer = bd_layers_find(slot, author);
    if (!layer) return BD_ERR_OK;
    // What is on its way was done last, and takes away what was laid of it before.
    if (slot->staged_count > slot->committing_count)
        return bd_err_set(detail, BD_ERR_BUSY, "commit",
                          "an edit of this scene is on its way to the disk");
    struct bd_batch *batch = bd_slot_new_batch(BD_BATCH_EDIT, slot);
    struct bd_clash none = {0};
    bd_batch_set_text(batch->client_edit_id, sizeof batch->client_edit_id, client_edit_id);
    bd_batch_set_text(batch->author, sizeof batch->author, layer->author);
    enum bd_err err =
        bd_delta_carry(slot->head, &layer->before, &layer->after, &batch->forward, &none)
            ? bd_slot_apply(slot, batch, detail)
            : bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the edit");
    if (err) {
        bd_batch_free(&batch);
        return err;
    }
    bd_layers_begin_commit(slot, layer, batch);
    count_transient(slot);
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

// Whether it fills a slot that what lies there has filled too: an undo or a replay comes with ids.
static bool means_another(const struct bd_slot *slot, const struct bd_batch *batch)
{
    for (uint32_t i = 0; i < batch->inverse.count; i++) {
        const struct bd_change *before = &batch->inverse.changes[i];
        if (!bd_change_is_removal(before)) continue;
        for (uint32_t k = 0; k < slot->layer_count; k++)
            if (bd_delta_get(&slot->layers[k].after, before->kind, before->id)) return true;
    }
    return false;
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
        bd_layers_end_commit(slot, batch, false);
    else if (means_another(slot, batch))
        drop_with_warning(slot, "their ids are those of other objects now");
    else
        bd_layers_forget(slot, &batch->forward);
    struct bd_store_past past = {batch->revision, batch->of, batch->kind, "", ""};
    memcpy(past.client_edit_id, batch->client_edit_id, sizeof past.client_edit_id);
    memcpy(past.author, batch->author, sizeof past.author);
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

void bd_store_fail(struct bd_store *store, struct bd_batch *batch)
{
    struct bd_slot *slot = bd_slot_find(store, batch->scene_id);
    BD_ASSERT(slot);
    leave_flight(store, slot, batch);
    if (batch->was_transient) {
        bd_layers_end_commit(slot, batch, true);
        count_transient(slot);
    }
    if (batch->kind == BD_BATCH_REMOVE) slot->is_leaving = false;
    if (batch->kind == BD_BATCH_ADD)
        bd_slot_drop(store, slot);
    else if (batch->after) // a name that could not be given leaves the edits beside it alone
        bd_slot_set_head(slot, slot->durable, slot->shown.revision);
}
