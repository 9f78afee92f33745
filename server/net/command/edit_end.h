// How a request that changes a scene ends: with an answer, a fault, or once it is on the disk.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMAND_EDIT_END_H
#define BD_NET_COMMAND_EDIT_END_H

#include "net/command/edit_work.h"

// Takes the answer; the work is gone.
void bd_edit_end(struct bd_edit_work *work, struct bd_answer answer);

// True, and the command is over, if there is nothing to go on with.
bool bd_edit_stop_here(struct bd_edit_work *work);

// The batch is staged: the answer waits for the disk, the queue of edits does not.
void bd_edit_wait_for_disk(struct bd_edit_work *work, struct bd_batch *batch,
                           struct bd_answer answer);

#endif
