// What shading reads of a vertex, brought to the world once for all and kept together: the vertices
// of a triangle lie scattered, and the wait for each line of the cache is what shading costs.
//
// Each vector is made unit at its vertex, before it is interpolated: the order in which a vertex
// shader does it, which differs where an instance is scaled unevenly.
//
// Private to reference/. Made on one thread, then read by all.

#ifndef BD_REFERENCE_SHADING_VERTEX_H
#define BD_REFERENCE_SHADING_VERTEX_H

#include <stdbool.h>

#include "scene/scene.h"

struct bd_shading_vertex {
    float normal[3];  // unit, world; zero if there is none
    float tangent[3]; // likewise
    float
        handedness; // of the bitangent: glTF's sign, turned round in a mirror image; 0: no tangent
    float uv[2];    // the first set; 0 if there is none
};

// `normal_from_mesh` and `world_from_mesh`: 3x3, row-major, the linear part's inverse transpose and
// itself, up to scale. `mirrored`: the latter's determinant is negative. Fills one for each vertex.
void bd_shading_vertices(const struct bd_primitive *primitive, const float normal_from_mesh[9],
                         const float world_from_mesh[9], bool mirrored,
                         struct bd_shading_vertex *out);

#endif
