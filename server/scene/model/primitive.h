// One primitive's streams, as a whole. Only scene/ includes this.
//
// Thread: whoever owns the primitive.

#ifndef BD_SCENE_MODEL_PRIMITIVE_H
#define BD_SCENE_MODEL_PRIMITIVE_H

#include <stdbool.h>

#include "base/err.h"
#include "scene/model/scene.h"

// Streams of its own with the same content, and the same material. False without memory; what
// `*to` holds then is to be freed all the same.
BD_MUST_CHECK
bool bd_primitive_copy(const struct bd_primitive *from, struct bd_primitive *to);
void bd_primitive_free_streams(struct bd_primitive *primitive);

// How many of the vertices some triangle uses. `used` is a mark for each, all false before.
uint32_t bd_primitive_mark_used(const struct bd_primitive *primitive, bool *used);

// How many of the triangles have normals at all three corners that point to their rear.
uint32_t bd_primitive_count_against_winding(const struct bd_primitive *primitive);

// Drops the vertices that no triangle uses; the others keep their order. False without memory, and
// nothing is changed.
BD_MUST_CHECK
bool bd_primitive_drop_unused(struct bd_primitive *primitive);

#endif
