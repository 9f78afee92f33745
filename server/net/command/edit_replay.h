// Revisions out of a journal, made again (`bounce replay`): deltas and the index that a scene
// begins with, in the bytes that the journal keeps. They are read as a stranger's.
//
// Thread: the event loop's, but for the one that says pool.

#ifndef BD_NET_COMMAND_EDIT_REPLAY_H
#define BD_NET_COMMAND_EDIT_REPLAY_H

#include "net/command/command_internal.h"
#include "net/command/edit_work.h"

// Of one that is about a scene, which stands at `revision`: what it makes and of what kind it is.
// BD_ERR_CONFLICT where the scene does not stand before it.
BD_MUST_CHECK
enum bd_err bd_edit_replay_check(struct bd_edit_work *work, uint64_t revision);
// Pool: its bytes to the delta, with content from `base` and from blobs.
BD_MUST_CHECK
enum bd_err bd_edit_replay_read(struct bd_edit_work *work);

#endif
