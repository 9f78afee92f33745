// Points of all surfaces and who asks for their light, as they lie in buffers
// (kernel/projected_point.h).
#ifndef BD_SHARED_PROJECTED_POINTS_H
#define BD_SHARED_PROJECTED_POINTS_H

#include "shared/types.h"

// Of a map: slots of points, and texels along a side, an even number.
#define BD_PROJECTED_MOST       1024u
#define BD_MICROBUFFER_SIDE_MIN 16u
#define BD_MICROBUFFER_SIDE_MAX 64u
// Of a cut.
#define BD_CLUSTERS_MAX 1024u

// A point is a uvec4: bits of its place, a normal's (bits_of_normal). Points in their order; of
// each the radiance of its front, then of its back, three floats each. A cluster is a uvec2: its
// first point, and how many. A texel is two vec4s: its weight (lights/microbuffer.h), nothing; the
// way through its middle, its solid angle.
#define BD_TEXEL_VEC4S 2u
// Who asks: bits of its place, its first cluster; across its map, how many clusters; along it, a
// number that others have not; the map's normal, its block's radius, 0 where none asks for the
// spread; its shading normal, how far it leaves its plane.
#define BD_POINT_ASKER_UVEC4S 5u
// What it gets, bits of all: its irradiance, the spread; the irradiance vector, nothing; the noise,
// nothing. Then of rays, in as many slots as the few more than in the mean may take, the texel of
// its map that each goes through, what that shows, what the ray counts, 1 over how many the texel
// has in the mean, or 0 of none, and which of the texel's it is (kernel/map_rays.h).
#define BD_POINT_LIGHT_UVEC4S  3u
#define BD_MAP_RAYS_MAX        1024u
#define BD_MAP_RAY_SLOTS(rays) ((rays) > 0u ? (rays) + (rays) / 8u + 6u : 0u)
// Sides that send by a lobe (lights/point_lobes.h): of each side where such a one begins, or
// BD_NO_LOBE; then those, each of so many uints, after which come the ways of its light.
#define BD_NO_LOBE          0xffffffffu
#define BD_POINT_LOBES      4u // at most
#define BD_POINT_LOBE_UINTS 4u
#define BD_SENDING_UINTS    (8u + BD_POINT_LOBES * BD_POINT_LOBE_UINTS)

struct bd_point_gather_args {
    BD_UINT explore, exploit; // of each cluster, of all
    BD_UINT all, is_uniform;  // 1: every point; of all clusters as many
    BD_UINT first_asker;      // of the slice
    BD_FLOAT area;            // that each point stands for
    BD_UINT rays;             // through the map, in the mean
    BD_UINT unused_0;
};

#ifndef BD_GLSL
struct bd_projected_point {
    float x, y, z; // render space
    uint32_t normal;
};
struct bd_point_cluster {
    uint32_t first, count; // at least one
    uint32_t name, step;
};
struct bd_point_texel {
    struct bd_vec4 weight, way_solid_angle;
};
struct bd_point_asker {
    float position[3];
    uint32_t first_cluster;
    float across[3];
    uint32_t cluster_count;
    float along[3];
    uint32_t chance;
    float up[3], radius;
    float normal[3], off_plane;
};
struct bd_point_light {
    float irradiance[3], spread;
    float vector[3], unused_0;
    float noise[3], unused_1;
};
struct bd_map_ray {
    uint32_t texel, seen;
    float counts;
    uint32_t of_texel;
};
struct bd_point_lobe {
    float irradiance[3];
    uint32_t way; // bits_of_normal
};
struct bd_sending_point {
    float base_color[3], metallic;
    float roughness, f0_dielectric;
    uint32_t normal, count;
    struct bd_point_lobe lobes[BD_POINT_LOBES];
};
_Static_assert(sizeof(struct bd_sending_point) == 4 * BD_SENDING_UINTS, "std430 size");
_Static_assert(sizeof(struct bd_projected_point) == 16, "std430 size");
_Static_assert(sizeof(struct bd_point_cluster) == 16, "std430 size");
_Static_assert(sizeof(struct bd_point_texel) == 16 * BD_TEXEL_VEC4S, "std430 size");
_Static_assert(sizeof(struct bd_point_asker) == 16 * BD_POINT_ASKER_UVEC4S, "std430 size");
_Static_assert(sizeof(struct bd_point_light) == 16 * BD_POINT_LIGHT_UVEC4S, "std430 size");
_Static_assert(sizeof(struct bd_map_ray) == 16, "std430 size");
_Static_assert(sizeof(struct bd_point_gather_args) == 32, "std140 size");
#endif

#endif
