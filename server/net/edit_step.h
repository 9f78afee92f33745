// Requests that change a scene: batches, undo, redo, revert, commit of what is transient, names;
// and a scene's coming and going.
//
// Thread: the event loop's.

#ifndef BD_NET_EDIT_STEP_H
#define BD_NET_EDIT_STEP_H

#include "net/command_internal.h"

// The command's request, to its answer. It is answered once what it asks for is on the disk.
void bd_command_edit(struct bd_command *command);
// command->scene becomes a scene of the store, at command->revision (0: 1); `name` is its name.
void bd_command_scene_add(struct bd_command *command, const char *name);
void bd_command_scene_remove(struct bd_command *command);

// What lies transient on a scene for a second, and nobody adds to it, is committed. Called now
// and then; `all`: whatever its age, before the end.
void bd_edit_commit_quiet(struct bd_net *net, bool all);

#endif
