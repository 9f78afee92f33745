// What delta.c and delta_flat.c share. Only they include this.

#ifndef BD_SCENE_DELTA_PARTS_H
#define BD_SCENE_DELTA_PARTS_H

#include "scene/delta.h"

void bd_change_finish(struct bd_change *change);
// Takes over the change's references; the order of changes is the caller's duty. False without
// memory, and nothing was taken.
BD_MUST_CHECK
bool bd_delta_append(struct bd_delta *delta, const struct bd_change *change);

#endif
