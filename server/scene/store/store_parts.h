// What the files of the store share: a scene as the store has it. Private to them.
//
// store.c: which scenes there are, and their past. store_stage.c: changes on their way to the disk.
// store_shown.c: what everybody sees, once they are there. store_layers.c: what lies transient over
// it.
//
// Thread: the event loop's.

#ifndef BD_SCENE_STORE_STORE_PARTS_H
#define BD_SCENE_STORE_STORE_PARTS_H

#include "scene/store/history.h"
#include "scene/store/store.h"

// What one author has laid and not committed, or what is being committed of it: states from which
// and to which, so that it changes nothing but what its author did, whatever becomes of the rest.
struct bd_layer {
    char author[BD_EDIT_AUTHOR_BYTES];
    const struct bd_batch *batch; // on its way to the disk; NULL: not yet
    uint64_t batches;
    uint64_t laid_ns; // the last of them
    struct bd_delta before, after;
};

struct bd_slot {
    struct bd_store_entry shown;
    bool is_listed;  // published
    bool is_leaving; // its removal is staged
    struct bd_scene *durable, *head;
    uint64_t head_revision;
    uint32_t staged_count; // on their way to the disk
    // What lies over `durable`, lowest first. An author has one at most that is not on its way.
    uint32_t layer_count, committing_count;
    struct bd_layer *layers;
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
// One that may be changed. NULL: BD_ERR_NOT_FOUND, and the error says so.
struct bd_slot *bd_slot_get(const struct bd_store *store, const char *id,
                            struct bd_err_detail *detail);
struct bd_slot *bd_slot_append(struct bd_store *store);
void bd_slot_drop(struct bd_store *store, struct bd_slot *slot);
// Takes a reference of its own.
void bd_slot_set_head(struct bd_slot *slot, struct bd_scene *scene, uint64_t revision);
BD_MUST_CHECK
enum bd_err bd_store_check_room(const struct bd_store *store, struct bd_err_detail *detail);

// store_stage.c
struct bd_batch *bd_slot_new_batch(enum bd_batch_kind kind, const struct bd_slot *slot);
void bd_batch_set_text(char *to, size_t size, const char *text);
// Makes the batch's snapshot, inverse and revision of its forward delta, and moves the head there.
BD_MUST_CHECK
enum bd_err bd_slot_apply(struct bd_slot *slot, struct bd_batch *batch,
                          struct bd_err_detail *detail);
void bd_slot_stage(struct bd_store *store, struct bd_slot *slot, struct bd_batch *batch);

// store_layers.c
void bd_layers_drop(struct bd_slot *slot); // all of them
// What an author has laid and not committed; NULL: nothing. `author` NULL: what has lain for
// longest.
struct bd_layer *bd_layers_find(const struct bd_slot *slot, const char *author);
// Adds what `delta` makes of what is shown. False, and nothing changed, without memory.
BD_MUST_CHECK
bool bd_layers_add(struct bd_slot *slot, const char *author, const struct bd_delta *delta);
// What all of them make of `scene`; `*out` is the caller's to finish. False without memory.
BD_MUST_CHECK
bool bd_layers_over(const struct bd_slot *slot, const struct bd_scene *scene, struct bd_delta *out);
// It is on its way: beneath all that is not.
void bd_layers_begin_commit(struct bd_slot *slot, struct bd_layer *layer, struct bd_batch *batch);
// It is durable, or (`failed`) its author's again.
void bd_layers_end_commit(struct bd_slot *slot, const struct bd_batch *batch, bool failed);
// What a durable batch says of an object is newer than what was laid of it.
void bd_layers_forget(struct bd_slot *slot, const struct bd_delta *delta);
uint64_t bd_layers_batches(const struct bd_slot *slot);
uint64_t bd_layers_objects(const struct bd_slot *slot); // of those that are not on their way

#endif
