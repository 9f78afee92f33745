// What is made and mended of triangles, whoever brought them: a file or an edit.
//
// Thread: whoever owns the primitive.

#ifndef BD_SCENE_MESH_MESH_H
#define BD_SCENE_MESH_MESH_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/model/scene.h"

// What was repaired or left out, added up.
struct bd_mesh_repairs {
    uint32_t nonfinite_vertices, degenerate_triangles, repaired_normals, repaired_tangents;
};

// How much a unit vector's length misses one by once its three numbers are floats: half a unit in
// the last place of each, at most 2^-25 sqrt(3), and a little.
#define BD_UNIT_ROUNDING 6e-8

// Removes triangles with a vertex that is not finite, and those without area.
void bd_mesh_clean_triangles(struct bd_primitive *primitive, struct bd_mesh_repairs *repairs);
// How many triangles that would remove.
uint32_t bd_mesh_count_unclean(const struct bd_primitive *primitive);

// Flat ones: gives each triangle its own vertices. Repaired: what is zero, or points nowhere, is
// made from the triangles around. False only without memory.
BD_MUST_CHECK
bool bd_mesh_flat_normals(struct bd_primitive *primitive);
BD_MUST_CHECK
bool bd_mesh_repair_normals(struct bd_primitive *primitive, struct bd_mesh_repairs *repairs);

// Checks given tangents, or makes them from a set of coordinates. False only without memory.
void bd_mesh_repair_tangents(struct bd_primitive *primitive, struct bd_mesh_repairs *repairs);
BD_MUST_CHECK
bool bd_mesh_make_tangents(struct bd_primitive *primitive, uint32_t uv_set);

#endif
