// What the files delta*.c share, and the layers of what is transient (store_layers.c).

#ifndef BD_SCENE_MODEL_DELTA_PARTS_H
#define BD_SCENE_MODEL_DELTA_PARTS_H

#include "scene/model/delta.h"

void bd_change_finish(struct bd_change *change);
// One reference more to what is heavy in it.
void bd_change_retain(const struct bd_change *change);
// Takes over the change's references; the order of changes is the caller's duty. False without
// memory, and nothing was taken.
BD_MUST_CHECK
bool bd_delta_append(struct bd_delta *delta, const struct bd_change *change);
// bd_delta_get, to be changed in place.
struct bd_change *bd_delta_find(struct bd_delta *delta, enum bd_object_kind kind, uint32_t id);

#endif
