// Arguments of pass/composite.
#ifndef BD_SHARED_COMPOSITE_H
#define BD_SHARED_COMPOSITE_H

#include "shared/types.h"

// Layers, in the order of enum bd_layer (frame/request.h).
#define BD_COMPOSITE_BEAUTY   0
#define BD_COMPOSITE_DIRECT   1
#define BD_COMPOSITE_INDIRECT 2
#define BD_COMPOSITE_EMISSION 3
#define BD_COMPOSITE_ALBEDO   4
#define BD_COMPOSITE_NORMAL   5
#define BD_COMPOSITE_DEPTH    6
#define BD_COMPOSITE_NOISE    7
#define BD_COMPOSITE_BLUR     8
#define BD_COMPOSITE_LAYERS   9

// A program writes those of surfaces (a mask), or of the others: no more images than every device
// has.
#define BD_COMPOSITE_SURFACES 0x70
#define BD_COMPOSITE_IMAGES   6
// The image of a layer.
#define BD_COMPOSITE_IMAGE(layer) ((layer) < 4u ? (layer) : (layer) < 7u ? (layer)-4u : (layer)-3u)

struct bd_composite_args {
    BD_FLOAT sub_frame_weight; // 1 / sub-frames (finish)
    BD_FLOAT unit_cd_m2;       // the frame's light unit
    BD_FLOAT render_unit_m;    // length of render space's unit
    BD_FLOAT noise_sign;       // of the halves' difference

    BD_UINT is_first_sub_frame; // 1: nothing was added before
    BD_UINT is_only_sub_frame;
    BD_UINT first_row; // of the slice
    BD_UINT row_count; // in it

    BD_UINT layer; // finish alone: BD_COMPOSITE_*
    BD_UINT unused_0;
    BD_UINT unused_1;
    BD_UINT unused_2;
};

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_composite_args) == 48, "std140 size");
#endif

#endif
