// Primitives of instances, flattened into reference space: what Embree is given and what an
// intersection and its shading read. Private to reference/; made on one thread, then read by all.

#ifndef BD_REFERENCE_FLATTEN_H
#define BD_REFERENCE_FLATTEN_H

#include "reference/geometry.h"

struct bd_flat_counts bd_flatten_count(const struct bd_scene *scene);

// Fills the geometry's parts, positions, triangles and tangents, which have room for those counts.
void bd_flatten(struct bd_geometry *geometry);
// Fills its parts alone, from those of a geometry of the same shape.
void bd_flatten_like(struct bd_geometry *geometry, const struct bd_geometry *like);

#endif
