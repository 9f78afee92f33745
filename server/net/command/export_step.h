// SceneExport: a snapshot, the shown one or one of the journal's, as a .glb.
//
// Thread: the event loop's.

#ifndef BD_NET_COMMAND_EXPORT_STEP_H
#define BD_NET_COMMAND_EXPORT_STEP_H

struct bd_command;

void bd_command_export(struct bd_command *command);

#endif
