// A batch that is only tried: what it would make of the scene, and what a frame would do again.

#ifndef BD_NET_COMMAND_EDIT_DRY_RUN_H
#define BD_NET_COMMAND_EDIT_DRY_RUN_H

#include "net/command/edit_work.h"

// Answers the command. `base`: what the batch was checked against. Borrowed.
void bd_edit_dry_run(struct bd_edit_work *work, const struct bd_scene *base);

#endif
