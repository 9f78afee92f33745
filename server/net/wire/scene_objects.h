// The objects of a scene by the ids that edits name them by, each in the words of the edit that
// would make it.

#ifndef BD_NET_WIRE_SCENE_OBJECTS_H
#define BD_NET_WIRE_SCENE_OBJECTS_H

#include "protocol/bounced.pb-c.h"
#include "scene/model/scene.h"

// Fills message->objects: what was authored and is not removed.
void bd_scene_objects_fill(Bounced__Scene *message, const struct bd_scene *scene);

#endif
