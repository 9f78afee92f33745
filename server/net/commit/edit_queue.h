// Edits in the order in which they came: of one scene, one at a time is checked and staged, however
// long its files took to read; of different scenes, side by side.
//
// An edit takes its turn on the scene by a step on bd_on_scene, and keeps it until what it staged
// is on its way to the disk (bd_on_disk), or until it ends (bd_edit_queue_leave).
//
// Thread: the event loop's.

#ifndef BD_NET_COMMIT_EDIT_QUEUE_H
#define BD_NET_COMMIT_EDIT_QUEUE_H

#include <stdbool.h>

#include "net/commit/commit.h"
#include "net/loop/steps.h"
#include "scene/store/store.h"

struct bd_commits;

// Part of whoever takes the turn of a scene, or waits for the disk; steps.place is its address.
struct bd_edit_place {
    struct bd_steps *steps;           // of the same owner
    char scene_id[BD_SCENE_ID_BYTES]; // whose turn; once on the disk, that of the batch
    struct bd_batch *batch;           // staged, for bd_on_disk; gone behind it
    bool is_staged;                   // on its way to the disk: a cancel comes too late

    // Ours.
    bool is_queued, has_begun;
    struct bd_commit_waiter waiter;
    struct bd_edit_place *next;
};

// No function of the step runs. The first waits until everything of place.scene_id that came before
// has left the queue. The second gives the turn up, and waits until place.batch is on the disk; the
// third keeps the turn: what was staged goes before what is to come.
extern const struct bd_step_executor bd_on_scene, bd_on_disk, bd_on_disk_held;

// For a step with the turn: not now. It is begun again when the queue is asked next, which it is
// after each commit at the latest: it has to look first whether it may go on.
void bd_edit_queue_wait(struct bd_edit_place *place);

// Whatever became of it: whoever comes after it on the scene may begin, once the queue is asked.
// False where the place is not in the queue.
bool bd_edit_queue_leave(struct bd_edit_place *place);

// Asks the queue: everything begins whose turn it is, before this returns, but where somebody
// further up asks it anyway (bd_commits.edits_wait).
void bd_edits_go_on(struct bd_commits *commits);

#endif
