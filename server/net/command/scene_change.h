// Requests by which scenes come and go. Each is answered once it is on the disk.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMAND_SCENE_CHANGE_H
#define BD_NET_COMMAND_SCENE_CHANGE_H

#include "net/command/command_internal.h"

// command->scene becomes a scene of the store, at command->revision (0: 1); `name` is its name.
void bd_command_scene_add(struct bd_command *command, const char *name);
void bd_command_scene_remove(struct bd_command *command);

#endif
