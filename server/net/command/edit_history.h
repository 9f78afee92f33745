// Requests about what was done to a scene: undo, redo, revert, the commit of what lies transient,
// names of revisions, what is played from a journal.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMAND_EDIT_HISTORY_H
#define BD_NET_COMMAND_EDIT_HISTORY_H

#include "net/command/edit_work.h"

// Each begins when it is the request's turn on its scene. False: not yet, ask again.
BD_MUST_CHECK
bool bd_edit_begin_undo(struct bd_edit_work *work); // and redo
BD_MUST_CHECK
bool bd_edit_begin_revert(struct bd_edit_work *work);
BD_MUST_CHECK
bool bd_edit_begin_replay(struct bd_edit_work *work); // a revision out of a journal
BD_MUST_CHECK
bool bd_edit_begin_commit(struct bd_edit_work *work);
BD_MUST_CHECK
bool bd_edit_begin_name(struct bd_edit_work *work);

#endif
