#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "scene/store/store_parts.h"

// --- slots ----------------------------------------------------------------------------------

struct bd_store *bd_store_create(uint32_t scene_count_max)
{
    struct bd_store *store = calloc(1, sizeof *store);
    BD_ASSERT(store);
    store->count_max = scene_count_max;
    store->staged_end = &store->staged;
    return store;
}

static void free_slot(struct bd_slot *slot)
{
    bd_scene_release(&slot->shown.scene);
    bd_scene_release(&slot->durable);
    bd_scene_release(&slot->head);
    bd_layers_drop(slot);
    bd_history_finish(&slot->history);
    free(slot);
}

void bd_store_destroy(struct bd_store **store)
{
    if (!*store) return;
    for (uint32_t i = 0; i < (*store)->in_flight_count; i++) bd_batch_free(&(*store)->in_flight[i]);
    for (uint32_t i = 0; i < (*store)->count; i++) free_slot((*store)->slots[i]);
    free((*store)->in_flight);
    free((*store)->slots);
    free(*store);
    *store = NULL;
}

struct bd_slot *bd_slot_find(const struct bd_store *store, const char *id)
{
    for (uint32_t i = 0; i < store->count; i++)
        if (strcmp(store->slots[i]->shown.id, id) == 0) return store->slots[i];
    return NULL;
}

struct bd_slot *bd_slot_get(const struct bd_store *store, const char *id,
                            struct bd_err_detail *detail)
{
    struct bd_slot *slot = bd_slot_find(store, id);
    if (slot && slot->is_listed && !slot->is_leaving) return slot;
    bd_err_set(detail, BD_ERR_NOT_FOUND, "scene", "there is no scene \"%.32s\"", id);
    return NULL;
}

struct bd_slot *bd_slot_append(struct bd_store *store)
{
    struct bd_slot **slots = realloc(store->slots, (store->count + 1) * sizeof *slots);
    struct bd_slot *slot = calloc(1, sizeof *slot);
    BD_ASSERT(slots && slot);
    store->slots = slots;
    slots[store->count++] = slot;
    return slot;
}

void bd_slot_drop(struct bd_store *store, struct bd_slot *slot)
{
    uint32_t i = 0;
    while (store->slots[i] != slot) i++;
    memmove(store->slots + i, store->slots + i + 1, (--store->count - i) * sizeof *store->slots);
    free_slot(slot);
}

enum bd_err bd_store_get(const struct bd_store *store, const char *id,
                         const struct bd_store_entry **out, struct bd_err_detail *detail)
{
    struct bd_slot *slot = bd_slot_find(store, id);
    if (!slot || !slot->is_listed)
        return bd_err_set(detail, BD_ERR_NOT_FOUND, "scene", "there is no scene \"%.32s\"", id);
    *out = &slot->shown;
    return BD_ERR_OK;
}

uint32_t bd_store_count(const struct bd_store *store)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < store->count; i++) count += store->slots[i]->is_listed;
    return count;
}

const struct bd_store_entry *bd_store_at(const struct bd_store *store, uint32_t index)
{
    for (uint32_t i = 0; i < store->count; i++)
        if (store->slots[i]->is_listed && index-- == 0) return &store->slots[i]->shown;
    return NULL;
}

struct bd_store_holdings bd_store_holdings(const struct bd_store *store, const char *owner,
                                           const char *but_bytes_of)
{
    struct bd_store_holdings held = {0};
    for (uint32_t i = 0; i < store->count; i++) {
        const struct bd_slot *slot = store->slots[i];
        if (strcmp(slot->shown.owner, owner) != 0) continue;
        held.scenes++;
        if (strcmp(slot->shown.id, but_bytes_of) != 0) held.bytes += bd_scene_bytes(slot->head);
    }
    return held;
}

void bd_slot_set_head(struct bd_slot *slot, struct bd_scene *scene, uint64_t revision)
{
    bd_scene_retain(scene);
    bd_scene_release(&slot->head);
    slot->head = scene;
    slot->head_revision = revision;
}

enum bd_err bd_store_check_room(const struct bd_store *store, struct bd_err_detail *detail)
{
    if (store->count < store->count_max) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_LIMIT, "scenes",
                      "%u scenes are held, which is the limit scenes: remove one first",
                      store->count);
}

// --- history --------------------------------------------------------------------------------

static enum bd_err nothing_left(const struct bd_slot *slot, const char *author, bool redo,
                                struct bd_err_detail *detail)
{
    const char *word = redo ? "redo" : "undo";
    const struct bd_history_entry *other = bd_history_target(&slot->history, NULL, redo);
    if (!author || !other)
        return bd_err_set(detail, BD_ERR_CONFLICT, word, "there is nothing to %s", word);
    const char *whose = redo ? other->by : other->author;
    return bd_err_set(detail, BD_ERR_CONFLICT, word,
                      "there is nothing of yours to %s; the last that there is is revision "
                      "%" PRIu64 ", by %.80s: the scope \"all\" takes it",
                      word, other->revision, whose[0] ? whose : "nobody that is known");
}

enum bd_err bd_store_undo_target(const struct bd_store *store, const char *id, const char *author,
                                 bool redo, uint64_t *out, struct bd_err_detail *detail)
{
    struct bd_slot *slot = bd_slot_get(store, id, detail);
    if (!slot) return BD_ERR_NOT_FOUND;
    if (slot->staged_count > 0)
        return bd_err_set(detail, BD_ERR_BUSY, redo ? "redo" : "undo",
                          "an edit of this scene is on its way to the disk");
    const struct bd_history_entry *target = bd_history_target(&slot->history, author, redo);
    if (!target) return nothing_left(slot, author, redo, detail);
    *out = target->revision;
    return BD_ERR_OK;
}

static bool is_in_flight(const struct bd_store *store, const char *id, const char *client_edit_id)
{
    for (uint32_t i = 0; i < store->in_flight_count; i++)
        if (strcmp(store->in_flight[i]->scene_id, id) == 0 &&
            strcmp(store->in_flight[i]->client_edit_id, client_edit_id) == 0)
            return true;
    return false;
}

enum bd_err bd_store_find_edit(const struct bd_store *store, const char *id,
                               const char *client_edit_id, uint64_t *revision,
                               struct bd_err_detail *detail)
{
    struct bd_slot *slot = bd_slot_get(store, id, detail);
    if (!slot) return BD_ERR_NOT_FOUND;
    if (is_in_flight(store, id, client_edit_id))
        return bd_err_set(detail, BD_ERR_BUSY, "client_edit_id",
                          "an edit of this id is on its way to the disk: ask again");
    *revision = bd_history_find(&slot->history, client_edit_id);
    return BD_ERR_OK;
}

enum bd_err bd_store_restore(struct bd_store *store, const struct bd_store_entry *entry,
                             const struct bd_store_past *past, uint32_t past_count,
                             struct bd_err_detail *detail)
{
    enum bd_err err = bd_store_check_room(store, detail);
    if (err) return err;
    BD_ASSERT(!bd_slot_find(store, entry->id));
    struct bd_slot *slot = bd_slot_append(store);
    slot->shown = *entry;
    slot->shown.scene = bd_scene_retain(entry->scene);
    slot->shown.transient = 0;
    slot->durable = bd_scene_retain(entry->scene);
    bd_slot_set_head(slot, entry->scene, entry->revision);
    slot->is_listed = true;
    for (uint32_t i = 0; i < past_count; i++) bd_history_add(&slot->history, &past[i]);
    return BD_ERR_OK;
}
