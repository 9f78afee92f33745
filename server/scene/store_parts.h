// What the files of the store share: a scene as the store has it. Private to them.
//
// store.c: which scenes there are, and their past. store_stage.c: changes on their way to the disk.
// store_shown.c: what everybody sees, once they are there, and what lies transient over it.
//
// Thread: the event loop's.

#ifndef BD_SCENE_STORE_PARTS_H
#define BD_SCENE_STORE_PARTS_H

#include "scene/history.h"
#include "scene/store.h"

struct bd_slot {
    struct bd_store_entry shown;
    bool is_listed;  // published
    bool is_leaving; // its removal is staged
    struct bd_scene *durable, *head;
    uint64_t head_revision;
    uint32_t staged_count; // on their way to the disk
    // What lies over `durable`: what is being committed, and over it what is not yet.
    struct bd_delta committing, overlay;
    uint32_t committing_count;
    uint64_t overlay_batches, committing_batches;
    struct bd_history history;
};

struct bd_store {
    uint32_t count, count_max;
    struct bd_slot **slots; // in order of addition
    struct bd_batch *staged, **staged_end;
    struct bd_batch **in_flight; // every batch that is neither published nor failed
    uint32_t in_flight_count;
};

struct bd_slot *bd_slot_find(const struct bd_store *store, const char *id);
// One that may be changed. NULL: BD_ERR_NOT_FOUND, and the fault says so.
struct bd_slot *bd_slot_get(const struct bd_store *store, const char *id, struct bd_fault *fault);
struct bd_slot *bd_slot_append(struct bd_store *store);
void bd_slot_drop(struct bd_store *store, struct bd_slot *slot);
// Takes a reference of its own.
void bd_slot_set_head(struct bd_slot *slot, struct bd_scene *scene, uint64_t revision);
BD_MUST_CHECK
enum bd_err bd_store_check_room(const struct bd_store *store, struct bd_fault *fault);

// store_stage.c
struct bd_batch *bd_slot_new_batch(enum bd_batch_kind kind, const struct bd_slot *slot);
void bd_batch_set_text(char *to, size_t size, const char *text);
// Makes the batch's snapshot, inverse and revision of its forward delta, and moves the head there.
BD_MUST_CHECK
enum bd_err bd_slot_apply(struct bd_slot *slot, struct bd_batch *batch, struct bd_fault *fault);
void bd_slot_stage(struct bd_store *store, struct bd_slot *slot, struct bd_batch *batch);

#endif
