// Between the store and the journal: staged batches to records, records to scenes.
//
// Thread: any that has the journal's turn; never the event loop's, since the disk is waited for.

#ifndef BD_SCENE_STORE_STORE_JOURNAL_H
#define BD_SCENE_STORE_STORE_JOURNAL_H

#include "base/err.h"
#include "scene/journal/journal.h"
#include "scene/store/store.h"

// Every so many revisions a snapshot is written beside the edits; and so many, or up to a snapshot
// more, can be gone back to.
#define BD_STORE_SNAPSHOT_EDITS 256
#define BD_STORE_KEEP_EDITS     1024

// Writes the list in one transaction, behind the content that it needs: all of it is on the disk
// when this returns BD_ERR_OK, else nothing is. Only reads the batches. `faulty` is the one that
// cannot be kept, NULL if the error is none of theirs.
BD_MUST_CHECK
enum bd_err bd_store_write(struct bd_journal *journal, const struct bd_batch *first,
                           const struct bd_batch **faulty, struct bd_err_detail *detail);

// All scenes that the journal holds, into an empty store: once, before anything is served. A scene
// whose newest revisions are damaged comes back at the last whole one; one of which nothing is
// whole is left out; both with a warning in the log that names it. The store's own limit does not
// lose scenes: BD_ERR_LIMIT if there are more.
BD_MUST_CHECK
enum bd_err bd_store_load(struct bd_store *store, struct bd_journal *journal,
                          struct bd_err_detail *detail);

// A scene as it was at a revision; the caller owns it. BD_ERR_NOT_FOUND.
BD_MUST_CHECK
enum bd_err bd_store_read_revision(struct bd_journal *journal, const char *id, uint64_t revision,
                                   struct bd_scene **out, struct bd_err_detail *detail);

// What made a revision, who did, and what takes it back. Content that `known` has is not read
// again. Free with bd_store_step_finish, which is nothing to do after a failure.
struct bd_store_step {
    char author[BD_EDIT_AUTHOR_BYTES];
    struct bd_delta forward, inverse;
};
BD_MUST_CHECK
enum bd_err bd_store_read_step(struct bd_journal *journal, const char *id, uint64_t revision,
                               const struct bd_scene *known, struct bd_store_step *out,
                               struct bd_err_detail *detail);
void bd_store_step_finish(struct bd_store_step *step);

// The index of a scene's revision, from which a later start begins (bd_journal_write_snapshot).
// Content of it that the journal has lost to damage is put anew.
BD_MUST_CHECK
enum bd_err bd_store_snapshot(struct bd_journal *journal, const char *id, uint64_t revision,
                              const struct bd_scene *scene, struct bd_err_detail *detail);

#endif
