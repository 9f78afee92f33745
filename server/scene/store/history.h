// What one scene's past says of its future: what undo and redo would take back, and which client
// edit ids are used up. Two lists of revisions, newest last: applying the inverse of one is the
// undo, or the redo.
//
// Each revision is somebody's. An undo of one's own takes one's newest out of the list, wherever it
// stands; a redo puts it back at the end, still as its author's. A new edit makes an end of its
// author's redos, and of everybody's for who redoes whatever was last.
//
// Thread: whoever owns the struct.

#ifndef BD_SCENE_STORE_HISTORY_H
#define BD_SCENE_STORE_HISTORY_H

#include <stdbool.h>
#include <stdint.h>

#include "scene/store/store.h"

// So many are remembered; older ones are forgotten, first of all.
#define BD_HISTORY_UNDO_MAX  1024
#define BD_HISTORY_KNOWN_MAX 4096

struct bd_known_edit {
    uint64_t hash; // of the client_edit_id
    uint64_t revision;
};

struct bd_history_entry {
    uint64_t revision;
    char author[BD_EDIT_AUTHOR_BYTES]; // whose edit it is, that is done or taken back
    char by[BD_EDIT_AUTHOR_BYTES];     // who did that
};

// Oldest first; room for BD_HISTORY_UNDO_MAX, or NULL until one is needed.
struct bd_history_list {
    uint32_t count;
    struct bd_history_entry *entries;
};

struct bd_history {
    struct bd_history_list undo, redo;
    uint64_t last_edit; // revision
    uint32_t known_count, known_next;
    struct bd_known_edit *known; // a ring
};

void bd_history_finish(struct bd_history *history);

// A revision that has been published, in order.
void bd_history_add(struct bd_history *history, const struct bd_store_past *past);

// The newest that `author` (NULL: whoever) may undo, or redo; NULL: nothing. Borrowed until the
// next is added.
const struct bd_history_entry *bd_history_target(const struct bd_history *history,
                                                 const char *author, bool redo);
// 0: not known. The hash of 64 bits may deceive: compare the id that the journal has.
uint64_t bd_history_find(const struct bd_history *history, const char *client_edit_id);

#endif
