// A punctual light, in render space and in the frame's light unit.
#ifndef BD_SHARED_LIGHT_H
#define BD_SHARED_LIGHT_H

#include "shared/types.h"

#define BD_LIGHT_KIND_DIRECTIONAL 0u
#define BD_LIGHT_KIND_POINT       1u
#define BD_LIGHT_KIND_SPOT        2u

struct bd_light_uniform {
    BD_VEC4 position;               // xyz
    BD_VEC4 direction;              // xyz, unit, from the light into the scene
    BD_VEC4 intensity;              // xyz cd (directional: lux)
    BD_VEC4 axis_x, axis_y, axis_z; // xyz, of face 0's frame

    BD_FLOAT inverse_range;           // 0: unlimited
    BD_FLOAT distance;                // of directional
    BD_FLOAT half_width, half_height; // of a face, tangents (orthographic: of its frame)

    BD_FLOAT cos_outer;  // with the next of a cone, all around if no spot
    BD_FLOAT per_cosine; // 1 / (cos(inner) - cos(outer))
    BD_UINT kind;        // BD_LIGHT_KIND_*
    BD_UINT face_count;

    BD_UINT face_side_px;
    BD_UINT unused_0;
    BD_UINT unused_1;
    BD_UINT unused_2;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_light_uniform) == 144, "std140 size");
#endif

#endif
