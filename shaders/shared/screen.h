// What a camera sees, as senders: pixels, and parts of four children each above them, level by
// level (algorithms.md A3, hierarchy). A level of a picture of odd size has a part for what is
// left.
//
// A part, in the array BD_UNIT_SCREEN_PARTS, three vec4s, the finest level first, each row by row;
// means are by area, so that what it sends far away is the sum of what its pixels send:
//   0: xyz middle, render space, w = area: the sum of its pixels'
//   1: xyz mean normal, shorter than 1 where normals differ, w = radius about the middle
//   2: rgb mean radiance, w = how far places lie off the plane of middle and normal
// What a pixel covers, in the array BD_UNIT_SCREEN_PATCHES, two vec4s: middle +- u +- v.
//   0: xyz u, w = what part of it counts
//   1: xyz v, w = how far the pixel's receiver is lifted off a crease
// A pixel as a receiver, in the array BD_UNIT_SCREEN_RECEIVERS, three vec4s:
//   0: xyz place, w = 1, or 0: it asks for nothing
//   1: xyz shading normal
//   2: xyz geometric normal
// Its surface, of those whose lobes are asked for, in the array BD_UNIT_SCREEN_SURFACES, three
// vec4s:
//   0: xyz viewer, unit, w = part of its lobe that is asked for
//   1: rgb base colour, w = metallic
//   2: x = roughness, y = F0 of a dielectric
#ifndef BD_SHARED_SCREEN_H
#define BD_SHARED_SCREEN_H

#include "shared/types.h"

#define BD_SCREEN_PART_VEC4S     3
#define BD_SCREEN_PATCH_VEC4S    2
#define BD_SCREEN_RECEIVER_VEC4S 3
#define BD_SCREEN_SURFACE_VEC4S  3
#define BD_SCREEN_LEVELS_MAX     15 // of a picture 16,384 wide

// Pixels along a side of a block, which knows where its pixels look: parts of the coarsest level
// from x = left, y = top on, before z = right and w = bottom.
#define BD_SCREEN_BLOCK_SIDE 4

struct bd_screen_args {
    BD_UINT width_px, height_px, level_count;
    BD_UINT first_row, row_count; // of the slice
    BD_FLOAT clamp;               // kernel/residual.h
    // A part is looked at closer where its projected solid angle may be more than that: of one that
    // spans no edge, and of others.
    BD_FLOAT smooth_sr, edge_sr;
    BD_UVEC4 levels[BD_SCREEN_LEVELS_MAX]; // x = width, y = height, z = its first part
};

#ifndef BD_GLSL
struct bd_screen_part {
    struct bd_vec4 middle_area, normal_radius, radiance_thickness;
};
struct bd_screen_patch {
    struct bd_vec4 u_part, v;
};
struct bd_screen_surface {
    struct bd_vec4 viewer_lobe, color_metallic, roughness_f0;
};
struct bd_screen_receiver {
    struct bd_vec4 place_lit, normal, normal_geometric;
};

_Static_assert(
    sizeof(struct bd_screen_part) == BD_SCREEN_PART_VEC4S * sizeof(struct bd_vec4) &&
        sizeof(struct bd_screen_patch) == BD_SCREEN_PATCH_VEC4S * sizeof(struct bd_vec4) &&
        sizeof(struct bd_screen_receiver) == BD_SCREEN_RECEIVER_VEC4S * sizeof(struct bd_vec4) &&
        sizeof(struct bd_screen_surface) == BD_SCREEN_SURFACE_VEC4S * sizeof(struct bd_vec4),
    "as they are in the arrays");
_Static_assert(sizeof(struct bd_screen_args) == 32 + 16 * BD_SCREEN_LEVELS_MAX, "std140 size");
#endif

#endif
