// What shading reads of a triangle's corner, brought to the world once for all.
//
// Each vector is made unit at its vertex, before it is interpolated: the order in which a vertex
// shader does it, which differs where an instance is scaled unevenly.
//
// Private to reference/. Any thread; no state.

#ifndef BD_REFERENCE_SHADING_VERTEX_H
#define BD_REFERENCE_SHADING_VERTEX_H

#include <stdbool.h>

#include "scene/model/scene.h"

struct bd_shading_vertex {
    float normal[3]; // unit, world; zero if there is none
    float uv[2];     // the first set; 0 if there is none
};

struct bd_shading_tangent {
    float tangent[3]; // unit, world; zero if there is none
    float handedness; // of the bitangent: glTF's sign, turned round in a mirror image
};

// An instance's linear part, 3x3, row-major, up to scale, and its inverse transpose.
struct bd_linear {
    float normal_from_mesh[9], world_from_mesh[9];
    bool mirrored; // the determinant is negative
};

struct bd_linear bd_linear_of(const bd_dmat4 *world_from_mesh);

struct bd_shading_vertex bd_shading_vertex_of(const struct bd_primitive *primitive, uint32_t vertex,
                              const struct bd_linear *linear);
// The primitive has tangents.
struct bd_shading_tangent bd_shading_tangent_of(const struct bd_primitive *primitive, uint32_t vertex,
                                              const struct bd_linear *linear);

#endif
