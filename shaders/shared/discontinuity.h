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

    BD_UINT first_row; // of the slice
    BD_UINT row_count; // in it
    BD_UINT level;     // of the blocks
    BD_UINT face;      // of the light's map

    BD_UINT neighbour_count; // that are asked: none, the 4 at the corners, or all 8
    BD_UINT unused_0;
    BD_UINT unused_1;
    BD_UINT unused_2;

    BD_FLOAT depth_threshold;  // above which a block spans a step in depth
    BD_FLOAT normal_threshold; // or surfaces that face apart
    BD_FLOAT depth_scale; // what depth is relative to in an orthographic view; 0 in a perspective
                          // one, where that is depth itself
    BD_FLOAT unused_3;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_discontinuity_args) == 304, "std140 size");
#endif

#endif
