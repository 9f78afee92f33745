// Normals as they are interpolated between a triangle's corners; maps of normals are not read.
// Private to lights/. Thread: any.

#ifndef BD_LIGHTS_SHADING_NORMAL_H
#define BD_LIGHTS_SHADING_NORMAL_H

#include "lights/surface_hits.h"

// Unit, in render space, on the side of the geometric one, which it is where corners tell none.
// `index`: the triangle's corners.
f3 bd_shading_normal(const struct bd_surface_hit *hit, const uint32_t index[3], float u, float v,
                     f3 geometric);

#endif
