// Arguments of pass/discontinuity.
#ifndef BD_SHARED_DISCONTINUITY_H
#define BD_SHARED_DISCONTINUITY_H

#include "shared/multires.h"

// The values of the defines BD_DEPTH_TEST and BD_NORMAL_TEST.
#define BD_TEST_RANGE 0 // depth: of z; normal: of its components
#define BD_TEST_JUMP  1 // depth: the slope of a pixel; normal: the chord between two pixels
#define BD_TEST_NONE  2
#define BD_TEST_STEP  3 // depth: how far a pixel and its two neighbours are from one plane

struct bd_discontinuity_args {
    BD_MULTIRES_LAYOUT multires;
    BD_UVEC4 slice; // x = first row, y = rows, z = level, w = face of the light's map
    BD_UVEC4 tests; // x = neighbours that are asked: none, the 4 at the corners, or all 8
    BD_VEC4 limits; // x = threshold of depth, y = of normals; z = what depth is relative to in an
                    // orthographic view, 0 in a perspective one: there it is depth itself
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_discontinuity_args) == 304, "std140 size");
#endif

#endif
