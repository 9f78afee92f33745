// The steps of bd_scene_finish, each in its own file. Only scene/ includes this.
//
// Thread: whoever owns the scene that is being built.

#ifndef BD_SCENE_MODEL_DERIVE_H
#define BD_SCENE_MODEL_DERIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/model/scene.h"

// Fills every node's world_from_node and in_scene from its parents, without recursion: chains of any length.
// Parents must exist and form no loop. False only without memory.
BD_MUST_CHECK
bool bd_derive_world_matrices(struct bd_scene *scene);

// Lists what the shown nodes place. Instances whose matrix is not finite, or maps everything onto
// a line or a point, cannot be seen and are left out, flagged. False only without memory.
BD_MUST_CHECK
bool bd_derive_instances(struct bd_scene *scene);
BD_MUST_CHECK
bool bd_derive_placements(struct bd_scene *scene);

// The order of nodes and meshes in a file means nothing, and no picture may hang on it: instances
// and lights are ordered by what they are, and by their nodes only where that is the same
// (draw_order.c). Part of the two above. False only without memory.
BD_MUST_CHECK
bool bd_derive_instance_order(struct bd_scene *scene);
BD_MUST_CHECK
bool bd_derive_light_order(struct bd_scene *scene);

// Bounds and what surfaces show need instances, lights need placements and bounds. What surfaces
// show costs a visit of every triangle that shines.
void bd_derive_bounds(struct bd_scene *scene);
void bd_derive_surface_features(struct bd_scene *scene);
void bd_derive_light_features(struct bd_scene *scene);

// Whether any light comes from it. Reads a map up to its first texel that shines.
bool bd_environment_shines(const struct bd_environment *environment);

// The default camera and the default light rig (default_rig.c), only where the scene places none.
// To place the camera costs a visit of every triangle, unless there is a scene that looks `alike`.
BD_MUST_CHECK
bool bd_derive_default_camera(struct bd_scene *scene, const struct bd_scene *alike);
BD_MUST_CHECK
bool bd_derive_default_lights(struct bd_scene *scene);

// What is in `scene` as it is in `base`, of two scenes with instances: bits of aspects, of surfaces
// and the environment.
uint32_t bd_same_surfaces(const struct bd_scene *base, const struct bd_scene *scene);
// Takes over the counters of what is the same in `base` (NULL: nothing is), and numbers the rest.
void bd_derive_aspects(struct bd_scene *scene, const struct bd_scene *base, uint32_t same);

// bd_scene_finish for a scene that came of a finished one: what is the same is taken over.
BD_MUST_CHECK
enum bd_err bd_derive_from(struct bd_scene *scene, const struct bd_scene *base,
                           struct bd_err_detail *detail);

// copy.c: empty slots, and a scene to be edited.
extern const struct bd_texture bd_texture_removed;
extern const struct bd_material bd_material_removed;
extern const struct bd_light bd_light_removed;
extern const struct bd_camera bd_camera_removed;
extern const struct bd_node bd_node_removed;
// One reference; NULL without memory.
struct bd_mesh *bd_mesh_create_removed(void);
struct bd_picture *bd_picture_create_removed(void);

// How many slots there are of each kind, empty ones included, the default rig not.
struct bd_scene_counts bd_scene_slots(const struct bd_scene *scene);
// An unfinished copy that shares what is heavy, with at least so many slots, new ones empty. NULL
// without memory.
struct bd_scene *bd_scene_copy(const struct bd_scene *base, const struct bd_scene_counts *slots);

// A value that no aspect of any scene of this process had before. Any thread.
uint64_t bd_derive_next_aspect(void);

#endif
