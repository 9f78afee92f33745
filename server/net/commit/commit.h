// From staged to acknowledged: what one turn of the loop staged goes to the journal as one
// transaction, and is published and answered when it is on the disk.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMIT_COMMIT_H
#define BD_NET_COMMIT_COMMIT_H

#include "base/err.h"
#include "scene/store/store.h"

struct bd_commits;

// Whoever staged a batch and waits for it: `batch->user`, or NULL if nobody does.
struct bd_commit_waiter {
    // Once: BD_ERR_OK after it was published, or why it was not. `batch` is gone afterwards.
    void (*done)(struct bd_commit_waiter *waiter, const struct bd_batch *batch, enum bd_err err,
                 const struct bd_err_detail *detail);
};

// Something was staged: it will be written once the loop has seen all that has arrived.
void bd_commit_soon(struct bd_commits *commits);

// The loop's part of it. Closed when nothing is under way any more, finished when the loop has
// heard of that.
void bd_commit_begin(struct bd_commits *commits);
void bd_commit_close(struct bd_commits *commits);
void bd_commit_finish(struct bd_commits *commits);

// Whether anything is staged, or on its way.
bool bd_commit_is_pending(const struct bd_commits *commits);

#endif
