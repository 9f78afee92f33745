// Requests that change a scene: batches, undo, redo, revert, commit of what is transient, names.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMAND_EDIT_STEP_H
#define BD_NET_COMMAND_EDIT_STEP_H

#include "net/command/command_internal.h"

// The command's request, to its answer. It is answered once what it asks for is on the disk.
void bd_command_edit(struct bd_command *command);

#endif
