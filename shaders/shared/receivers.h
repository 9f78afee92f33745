// Receivers of a slice and the light that they got, as loops over lanes find them (pass/native).
//
// In groups of BD_LANES, receiver i at lane i % BD_LANES of group i / BD_LANES; a group is a float
// of each lane for each field, so that a loop over lanes reads what lies side by side. Vectors
// take three fields.
#ifndef BD_SHARED_RECEIVERS_H
#define BD_SHARED_RECEIVERS_H

#include "shared/types.h"

#define BD_LANES 64u

// Fields of a receiver.
#define BD_RECEIVER_POSITION         0u // render space
#define BD_RECEIVER_NORMAL           3u
#define BD_RECEIVER_NORMAL_GEOMETRIC 6u
#define BD_RECEIVER_LIT              9u  // 1, or 0: it asks for nothing
#define BD_RECEIVER_RADIUS           10u // of its block, render units (kernel/light_spread.h); a pixel's is 0
#define BD_RECEIVER_OFF_PLANE        11u
#define BD_RECEIVER_FIELDS           12u

// Fields of where its rays start, of those who ask a few: words, since numbers of triangles are
// none of the floats.
#define BD_START_POSITION         0u // on the surface: a block's receiver lies between pixels
#define BD_START_NORMAL_GEOMETRIC 3u
#define BD_START_TRIANGLE         6u // its number, or BD_NO_TRIANGLE
#define BD_START_PLACE            7u // of its choice in each part (common/systematic.glsl)
#define BD_START_FIELDS           8u

// Fields of its surface, of those who ask what specular lobes reflect.
#define BD_GLOSSY_VIEWER        0u // unit, from the surface
#define BD_GLOSSY_BASE_COLOR    3u
#define BD_GLOSSY_METALLIC      6u
#define BD_GLOSSY_ROUGHNESS     7u
#define BD_GLOSSY_F0_DIELECTRIC 8u
#define BD_GLOSSY_HAS_LOBE      9u // 1, or 0: none that is worth its price
#define BD_GLOSSY_FIELDS        10u

// Fields of its light.
#define BD_LIGHT_IRRADIANCE 0u
#define BD_LIGHT_VECTOR     3u // the irradiance vector
#define BD_LIGHT_SPREAD     6u
#define BD_LIGHT_NOISE      7u // half the difference of the halves
#define BD_LIGHT_FIELDS     10u

// What its specular lobe reflects beyond the diffuse one is a vector alone.
#define BD_GLOSSY_LIGHT_FIELDS 3u

#ifndef BD_GLSL
struct bd_lanes3 {
    float x[BD_LANES], y[BD_LANES], z[BD_LANES];
};
struct bd_receivers {
    struct bd_lanes3 position, normal, normal_geometric;
    float lit[BD_LANES], radius[BD_LANES], off_plane[BD_LANES];
};
struct bd_ray_starts {
    struct bd_lanes3 position, normal_geometric;
    uint32_t triangle[BD_LANES];
    float place[BD_LANES];
};
struct bd_glossy_receivers {
    struct bd_lanes3 viewer, base_color;
    float metallic[BD_LANES], roughness[BD_LANES], f0_dielectric[BD_LANES], has_lobe[BD_LANES];
};
struct bd_receiver_light {
    struct bd_lanes3 irradiance, vector;
    float spread[BD_LANES];
    struct bd_lanes3 noise;
};
_Static_assert(sizeof(struct bd_receivers) == 4 * BD_RECEIVER_FIELDS * BD_LANES, "as in GLSL");
_Static_assert(sizeof(struct bd_ray_starts) == 4 * BD_START_FIELDS * BD_LANES, "as in GLSL");
_Static_assert(sizeof(struct bd_glossy_receivers) == 4 * BD_GLOSSY_FIELDS * BD_LANES, "as in GLSL");
_Static_assert(sizeof(struct bd_lanes3) == 4 * BD_GLOSSY_LIGHT_FIELDS * BD_LANES, "as in GLSL");
_Static_assert(sizeof(struct bd_receiver_light) == 4 * BD_LIGHT_FIELDS * BD_LANES, "as in GLSL");
#endif

#endif
