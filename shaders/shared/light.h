// A punctual light, in render space and in the frame's light unit.
#ifndef BD_SHARED_LIGHT_H
#define BD_SHARED_LIGHT_H

#include "shared/types.h"

#define BD_LIGHT_KIND_DIRECTIONAL 0u
#define BD_LIGHT_KIND_POINT       1u
#define BD_LIGHT_KIND_SPOT        2u

struct bd_light_uniform {
    BD_VEC4 position;  // xyz; w = 1 / range, 0 = unlimited
    BD_VEC4 direction; // xyz, unit, from the light into the scene; w = distance of directional
    BD_VEC4 intensity; // xyz cd (directional: lux)
    BD_VEC4 cone;      // x = cos(outer), y = 1 / (cos(inner) - cos(outer)); all around if no spot
    BD_UVEC4 kind;     // x = BD_LIGHT_KIND_*, y = number of faces, z = side of a face, texels
    BD_VEC4 axis_x;    // of face 0's frame; w = tangent of its half width (orthographic: half width)
    BD_VEC4 axis_y;
    BD_VEC4 axis_z;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_light_uniform) == 128, "std140 size");
#endif

#endif
