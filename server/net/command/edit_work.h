// One request that changes a scene, while it is carried out: what the files edit_*.c share.
//
// Thread: the event loop's, but for the two that say beside it.

#ifndef BD_NET_COMMAND_EDIT_WORK_H
#define BD_NET_COMMAND_EDIT_WORK_H

#include "net/command/command_internal.h"
#include "net/command/edit_heavy.h"
#include "scene/journal/journal.h"
#include "scene/store/store_journal.h"

struct bd_edit_work {
    struct bd_command *command; // which owns it
    bool is_transient, is_repeated;
    char client_edit_id[BD_EDIT_ID_BYTES];
    char author[BD_EDIT_AUTHOR_BYTES];

    // Of a batch
    size_t op_count;
    struct bd_edit_op *ops;
    int32_t *ids;
    struct bd_edit_flags flags;
    uint64_t quota_bytes; // that its content may take (edit_budget.h)

    // Of undo, redo and revert, and of what is played from a journal
    enum bd_batch_kind kind;
    bool is_mine; // undo and redo: of the author alone
    uint64_t of, head_revision;
    const char *message;              // borrowed from the request; NULL: none
    uint64_t base_revision;           // that the request was made for; 0: any
    struct bd_err_detail read_detail; // of what was read for a head that may have moved since

    struct bd_scene *base; // what is read beside the loop is read for this
    struct bd_delta delta;
};

// What can be said against the request before its turn: a missing scene, words, lengths. Sets the
// command's place in the queue, too.
BD_MUST_CHECK
enum bd_err bd_edit_work_create(struct bd_command *command, struct bd_edit_work **out);
void bd_edit_work_destroy(struct bd_edit_work **work); // takes NULL

// The operations, without what is heavy. Once only.
BD_MUST_CHECK
enum bd_err bd_edit_work_decode(struct bd_edit_work *work);
// Beside the loop, by the batch's weight.
BD_MUST_CHECK
enum bd_err bd_edit_work_read_heavy(struct bd_edit_work *work);
// Beside the loop, with the journal's turn: what takes the scene from `base` to where undo, redo or
// revert lead.
BD_MUST_CHECK
enum bd_err bd_edit_work_read_past(struct bd_edit_work *work, struct bd_journal *journal);

// The answer to a batch that is only tried. `base`: what it was checked against.
BD_MUST_CHECK
enum bd_err bd_edit_dry_run(struct bd_edit_work *work, const struct bd_scene *base);

#endif
