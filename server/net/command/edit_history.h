// Requests about what was done to a scene: undo, redo, revert, the commit of what lies transient,
// names of revisions, what is played from a journal.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMAND_EDIT_HISTORY_H
#define BD_NET_COMMAND_EDIT_HISTORY_H

#include "net/command/edit_work.h"

// Of a request whose turn on its scene it is. Undo is redo, too.
extern const struct bd_step bd_steps_undo[], bd_steps_revert[], bd_steps_commit[], bd_steps_name[];
extern const struct bd_step bd_steps_replay_edit[]; // a revision out of a journal

#endif
