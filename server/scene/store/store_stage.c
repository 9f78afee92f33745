// Batches on their way to the disk.

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>

#include "base/assert.h"
#include "scene/store/store_parts.h"

const char *bd_batch_kind_name(enum bd_batch_kind kind)
{
    static const char *const names[] = {"import", "", "edit", "undo", "redo", "revert", "", ""};
    return names[kind];
}

void bd_batch_free(struct bd_batch **batch)
{
    bd_delta_finish(&(*batch)->forward);
    bd_delta_finish(&(*batch)->inverse);
    bd_scene_release(&(*batch)->after);
    free((*batch)->answer);
    free(*batch);
    *batch = NULL;
}

static uint64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (uint64_t)now.tv_sec * 1000 + (uint64_t)now.tv_nsec / 1000000;
}

struct bd_batch *bd_slot_new_batch(enum bd_batch_kind kind, const struct bd_slot *slot)
{
    struct bd_batch *batch = calloc(1, sizeof *batch);
    BD_ASSERT(batch);
    batch->kind = kind;
    batch->time_ms = now_ms();
    memcpy(batch->scene_id, slot->shown.id, sizeof batch->scene_id);
    return batch;
}

void bd_slot_stage(struct bd_store *store, struct bd_slot *slot, struct bd_batch *batch)
{
    struct bd_batch **in_flight =
        realloc(store->in_flight, (store->in_flight_count + 1) * sizeof *in_flight);
    BD_ASSERT(in_flight);
    store->in_flight = in_flight;
    in_flight[store->in_flight_count++] = batch;
    slot->staged_count++;
    *store->staged_end = batch;
    store->staged_end = &batch->next;
}

static void make_id(char id[BD_SCENE_ID_BYTES])
{
    uint64_t random;
    ssize_t size = getrandom(&random, sizeof random, 0);
    BD_ASSERT_CMP(size, ==, (ssize_t)sizeof random);
    snprintf(id, BD_SCENE_ID_BYTES, "%016" PRIx64, random);
}

enum bd_err bd_store_stage_add(struct bd_store *store, struct bd_scene *scene, const char *name,
                               const char *owner, struct bd_batch **out,
                               struct bd_err_detail *detail)
{
    return bd_store_stage_add_at(store, scene, name, owner, 1, out, detail);
}

enum bd_err bd_store_stage_add_at(struct bd_store *store, struct bd_scene *scene, const char *name,
                                  const char *owner, uint64_t revision, struct bd_batch **out,
                                  struct bd_err_detail *detail)
{
    enum bd_err err = bd_store_check_room(store, detail);
    if (err) return err;
    struct bd_slot *slot = bd_slot_append(store);
    make_id(slot->shown.id);
    snprintf(slot->shown.name, sizeof slot->shown.name, "%s", name);
    snprintf(slot->shown.owner, sizeof slot->shown.owner, "%s", owner);
    bd_slot_set_head(slot, scene, revision);
    struct bd_batch *batch = bd_slot_new_batch(BD_BATCH_ADD, slot);
    batch->revision = revision;
    batch->after = bd_scene_retain(scene);
    memcpy(batch->name, slot->shown.name, sizeof batch->name);
    memcpy(batch->owner, slot->shown.owner, sizeof batch->owner);
    bd_batch_set_text(batch->author, sizeof batch->author, owner);
    bd_slot_stage(store, slot, batch);
    *out = batch;
    return BD_ERR_OK;
}

enum bd_err bd_store_stage_remove(struct bd_store *store, const char *id, struct bd_batch **out,
                                  struct bd_err_detail *detail)
{
    struct bd_slot *slot = bd_slot_get(store, id, detail);
    if (!slot) return BD_ERR_NOT_FOUND;
    slot->is_leaving = true;
    *out = bd_slot_new_batch(BD_BATCH_REMOVE, slot);
    bd_slot_stage(store, slot, *out);
    return BD_ERR_OK;
}

enum bd_err bd_store_head(const struct bd_store *store, const char *id, const struct bd_scene **out,
                          uint64_t *revision, struct bd_err_detail *detail)
{
    struct bd_slot *slot = bd_slot_get(store, id, detail);
    if (!slot) return BD_ERR_NOT_FOUND;
    *out = slot->head;
    *revision = slot->head_revision;
    return BD_ERR_OK;
}

static enum bd_err check_base(const struct bd_slot *slot, uint64_t base,
                              struct bd_err_detail *detail)
{
    if (base == 0 || base == slot->head_revision) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_CONFLICT, "base_revision",
                      "the scene is at revision %" PRIu64 ", not %" PRIu64, slot->head_revision,
                      base);
}

void bd_batch_set_text(char *to, size_t size, const char *text)
{
    snprintf(to, size, "%s", text ? text : "");
}

// Applies the batch's forward delta to the head. After an error the batch is the caller's to free.
enum bd_err bd_slot_apply(struct bd_slot *slot, struct bd_batch *batch,
                          struct bd_err_detail *detail)
{
    enum bd_err err = bd_delta_apply(slot->head, &batch->forward, &batch->after, detail);
    if (!err && !bd_delta_invert(slot->head, &batch->forward, &batch->inverse))
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the edit");
    if (err) return err;
    batch->revision = slot->head_revision + 1;
    bd_slot_set_head(slot, batch->after, batch->revision);
    return BD_ERR_OK;
}

enum bd_err bd_store_stage(struct bd_store *store, const struct bd_store_change *change,
                           struct bd_batch **out, struct bd_err_detail *detail)
{
    struct bd_slot *slot = bd_slot_get(store, change->scene_id, detail);
    if (!slot) return BD_ERR_NOT_FOUND;
    enum bd_err err = check_base(slot, change->base_revision, detail);
    if (err) return err;
    struct bd_batch *batch = bd_slot_new_batch(change->kind, slot);
    batch->of = change->of;
    bd_batch_set_text(batch->client_edit_id, sizeof batch->client_edit_id, change->client_edit_id);
    bd_batch_set_text(batch->message, sizeof batch->message, change->message);
    bd_batch_set_text(batch->author, sizeof batch->author, change->author);
    batch->forward = *change->delta;
    err = bd_slot_apply(slot, batch, detail);
    if (err) {
        batch->forward = (struct bd_delta){0}; // still the caller's
        bd_batch_free(&batch);
        return err;
    }
    *change->delta = (struct bd_delta){0};
    bd_slot_stage(store, slot, batch);
    *out = batch;
    return BD_ERR_OK;
}

enum bd_err bd_store_stage_name(struct bd_store *store, const char *id, const char *name,
                                uint64_t revision, bool remove, struct bd_batch **out,
                                struct bd_err_detail *detail)
{
    struct bd_slot *slot = bd_slot_get(store, id, detail);
    if (!slot) return BD_ERR_NOT_FOUND;
    if (!name || !name[0] || strlen(name) >= BD_REVISION_NAME_BYTES)
        return bd_err_set(detail, BD_ERR_USAGE, "name", "a name has 1 to %d bytes",
                          BD_REVISION_NAME_BYTES - 1);
    if (revision > slot->head_revision)
        return bd_err_set(detail, BD_ERR_NOT_FOUND, "revision", "the scene is at revision %" PRIu64,
                          slot->head_revision);
    struct bd_batch *batch = bd_slot_new_batch(remove ? BD_BATCH_UNNAME : BD_BATCH_NAME, slot);
    batch->of = revision ? revision : slot->head_revision;
    bd_batch_set_text(batch->name, sizeof batch->name, name);
    bd_slot_stage(store, slot, batch);
    *out = batch;
    return BD_ERR_OK;
}

bool bd_store_is_busy(const struct bd_store *store, const char *id)
{
    const struct bd_slot *slot = bd_slot_find(store, id);
    return slot && slot->staged_count > 0;
}

struct bd_batch *bd_store_take_staged(struct bd_store *store)
{
    struct bd_batch *first = store->staged;
    store->staged = NULL;
    store->staged_end = &store->staged;
    return first;
}

bool bd_store_has_staged(const struct bd_store *store)
{
    return store->staged != NULL;
}
