// What one scene's past says of its future: what undo and redo would take back, and which client
// edit ids are used up. Two stacks of revisions: applying the inverse of the top one is the undo,
// or the redo.
//
// Thread: whoever owns the struct.

#ifndef BD_SCENE_HISTORY_H
#define BD_SCENE_HISTORY_H

#include <stdbool.h>
#include <stdint.h>

#include "scene/store.h"

// So many are remembered; older ones are forgotten, first of all.
#define BD_HISTORY_UNDO_MAX  1024
#define BD_HISTORY_KNOWN_MAX 4096

struct bd_known_edit {
    uint64_t hash; // of the client_edit_id
    uint64_t revision;
};

struct bd_history {
    uint32_t undo_count, redo_count, known_count, known_next;
    uint64_t *undo, *redo;       // of BD_HISTORY_UNDO_MAX, or NULL until one is needed
    struct bd_known_edit *known; // a ring
};

void bd_history_finish(struct bd_history *history);

// A revision that has been published, in order.
void bd_history_add(struct bd_history *history, const struct bd_store_past *past);

// 0: nothing.
uint64_t bd_history_undo_target(const struct bd_history *history, bool redo);
// 0: not known. The hash of 64 bits may deceive: compare the id that the journal has.
uint64_t bd_history_find(const struct bd_history *history, const char *client_edit_id);

#endif
