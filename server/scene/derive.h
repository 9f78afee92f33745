// The steps of bd_scene_finish, each in its own file. Only scene/ includes this.
//
// Thread: whoever owns the scene that is being built.

#ifndef BD_SCENE_DERIVE_H
#define BD_SCENE_DERIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/scene.h"

// Fills every node's world_from_node from its parents, without recursion: chains of any length.
// Parents must exist and form no loop. False only without memory.
BD_MUST_CHECK
bool bd_derive_world_matrices(struct bd_scene *scene);

// Lists what the shown nodes place. Instances whose matrix is not finite, or maps everything onto
// a line or a point, cannot be seen and are left out, flagged. False only without memory.
BD_MUST_CHECK
bool bd_derive_instances(struct bd_scene *scene);
BD_MUST_CHECK
bool bd_derive_placements(struct bd_scene *scene);

// The order of nodes and meshes in a file means nothing, and no picture may hang on it: instances and
// lights are ordered by what they are, and by their nodes only where that is the same
// (order.c). Part of the two above. False only without memory.
BD_MUST_CHECK
bool bd_derive_instance_order(struct bd_scene *scene);
BD_MUST_CHECK
bool bd_derive_light_order(struct bd_scene *scene);

// Bounds need instances; the rest of the features need placements too.
void bd_derive_bounds(struct bd_scene *scene);
void bd_derive_features(struct bd_scene *scene);

// Whether any light comes from it. Reads a map up to its first texel that shines.
bool bd_environment_shines(const struct bd_environment *environment);

// The default camera and the default light rig (default_rig.c), only where the scene places none.
BD_MUST_CHECK
bool bd_derive_default_camera(struct bd_scene *scene);
BD_MUST_CHECK
bool bd_derive_default_lights(struct bd_scene *scene);

// A value that no aspect of any scene of this process had before. Any thread.
uint64_t bd_derive_next_aspect(void);

#endif
