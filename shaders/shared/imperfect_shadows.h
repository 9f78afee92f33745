// Imperfect shadow maps as they lie in buffers (kernel/imperfect_shadow.h).
#ifndef BD_SHARED_IMPERFECT_SHADOWS_H
#define BD_SHARED_IMPERFECT_SHADOWS_H

#include "shared/types.h"

// A point of a surface: xyz of its place, nothing; xyz of the normal, the square of the radius of
// the disk that it stands for, 0 where there is none.
#define BD_SHADOW_POINT_VEC4S 2
// Whence a map looks: xyz of the place, the number of the first of its points; xyz of the normal, 1
// where there is a light; xyz across it, nothing.
#define BD_SHADOW_CENTRE_VEC4S 3

struct bd_imperfect_args {
    BD_UINT first_map; // of the slice
    BD_UINT side;      // texels
    BD_UINT points;    // of each map
    BD_UINT fills;     // 1: empty texels ask their neighbours
    BD_UINT first_segment;
    BD_UINT end_segment;
    BD_FLOAT bias;
    BD_UINT unused_0;
};

#ifndef BD_GLSL
struct bd_shadow_point {
    struct bd_vec4 place, normal_radius2;
};
struct bd_shadow_centre {
    struct bd_vec4 place_first, normal_there, across;
};
_Static_assert(sizeof(struct bd_shadow_point) == 16 * BD_SHADOW_POINT_VEC4S, "std430 size");
_Static_assert(sizeof(struct bd_shadow_centre) == 16 * BD_SHADOW_CENTRE_VEC4S, "std430 size");
_Static_assert(sizeof(struct bd_imperfect_args) == 32, "std140 size");
#endif

#endif
