// What is where a ray met a triangle: materials, maps, normals, alpha. The reference's own reading
// of glTF; textures are filtered as a GPU filters them: level 0, bilinear (or nearest where the
// sampler says so), wrapped per axis, sRGB decoded before filtering.
//
// Any thread; reads the snapshot only.

#ifndef BD_REFERENCE_SURFACE_H
#define BD_REFERENCE_SURFACE_H

#include <stdbool.h>
#include <stdint.h>

#include "reference/bsdf.h"
#include "reference/shading_vertex.h"
#include "scene/model/scene.h"

// One triangle of an instance, and a point in it. Barycentrics as Embree has them: u belongs to the
// second vertex, v to the third.
struct bd_hit {
    const struct bd_instance *instance;
    const struct bd_primitive *primitive;
    uint32_t triangle; // index of its first index / 3
    float u, v;
    const struct bd_shading_vertex *corners;   // 3
    const struct bd_shading_tangent *tangents; // 3; NULL: no normal map
    float normal_geometric[3]; // unit, of the triangle in the world, by its winding: glTF's front
};

// sRGB byte to linear, exact to fp32. For tests; the maps use the same table.
float bd_srgb_to_linear(uint8_t value);

// Base colour's alpha at the hit, factor x map x vertex colour. For the tracer's alpha tests.
float bd_surface_alpha(const struct bd_scene *scene, const struct bd_hit *hit);

// Fills `out` for a viewer in direction `wo`. `lambert` and `transmission` as in struct
// bd_integrand.
void bd_surface_at(const struct bd_scene *scene, const struct bd_hit *hit, const float wo[3],
                   bool lambert, bool transmission, struct bd_surface *out);

#endif
