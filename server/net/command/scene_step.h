// Requests that look at scenes: lists, one scene with its objects, its log.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMAND_SCENE_STEP_H
#define BD_NET_COMMAND_SCENE_STEP_H

#include "net/command/command_internal.h"

// Each takes the command to its answer.
void bd_command_scene_list(struct bd_command *command);
void bd_command_scene_get(struct bd_command *command);
void bd_command_scene_log(struct bd_command *command);

#endif
