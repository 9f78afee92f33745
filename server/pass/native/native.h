// Arithmetic on the processor, where the device is software: loops over the receivers of a group
// (shared/receivers.h), a lane each, with the formulas of shaders/kernel. They stand once and are
// compiled for several widths of vectors; every width, compiler and number of threads gives the
// same bits, since no sum is reordered and nothing is contracted.
//
// Thread: any; a receiver group is one thread's.

#ifndef BD_PASS_NATIVE_NATIVE_H
#define BD_PASS_NATIVE_NATIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "kernel/math.h"
#include "shared/gather_tree.h"
#include "shared/imperfect_shadows.h"
#include "shared/light.h"
#include "shared/projected_points.h"
#include "shared/rays.h"
#include "shared/receivers.h"
#include "shared/screen.h"
#include "shared/types.h"
#include "shared/view.h"

// VPLs as they are in the arrays of a list (shared/vpl.h), those from `first` to before `end`.
struct bd_native_vpls {
    const struct bd_vec4 *vpls, *quads;
    uint32_t first, end;
};

// Which of them a group's lanes do not see: of each lane in turn `words` words, the bits of which
// are VPLs from the first on.
struct bd_native_hidden {
    const uint32_t *bits; // NULL: none are hidden
    uint32_t words;
};

// Neighbours of a list side by side, as one receiver looks at them; behind its end, some without
// strength, which is flux, all channels together.
#define BD_NATIVE_BLOCK 16u
struct bd_native_block {
    float x[BD_NATIVE_BLOCK], y[BD_NATIVE_BLOCK], z[BD_NATIVE_BLOCK];
    float normal_x[BD_NATIVE_BLOCK], normal_y[BD_NATIVE_BLOCK], normal_z[BD_NATIVE_BLOCK];
    float area[BD_NATIVE_BLOCK], near2[BD_NATIVE_BLOCK], strength[BD_NATIVE_BLOCK];
};

#define BD_NATIVE_GROUP_MAX 64u

// What a few of a list are chosen by (pass/choose.h): all of it, from 0 on, in groups of whole
// blocks.
struct bd_native_choice {
    struct bd_native_vpls vpls;
    const struct bd_native_block *blocks;
    const struct bd_vec4
        *groups; // that count as one VPL where they are far (shared/vpl.h), or NULL
    uint32_t group_vpls, group_count; // of those at most BD_NATIVE_GROUP_MAX
    uint32_t rays;                    // of a lane
    float view_reach;                 // largest coordinate of the view's position
};

// Of groups of VPLs, or of rays.
struct bd_native_part {
    uint32_t first, end;
};

// Of a VPL of each lane, its light times how many it stands for.
struct bd_native_pick {
    struct bd_lanes3 irradiance, vector;
    uint32_t vpl[BD_LANES]; // or BD_NATIVE_NO_VPL
};
#define BD_NATIVE_NO_VPL UINT32_MAX

// A tree of VPLs (shared/vpl_tree.h) over a list of leaves, and how it is cut: from
// args.first_root on root_count roots; what args say of the device's slices and rounds is not read.
struct bd_native_tree {
    const struct bd_vec4 *nodes;
    struct bd_native_vpls leaves;
    struct bd_gather_tree_args args;
};

// Leaves of a tree in Morton order of their place in a face, those from `first` on, at most
// BD_LANES: of the face's grid of `side` x `side` VPLs (shared/vpl_tree.h).
struct bd_native_leaves {
    const struct bd_vec4 *vpls, *quads; // of the face
    uint32_t side, first, count;
    struct bd_vec4 light; // its position
    bool directional;
};

// Pixels as the G-buffer has them (pass/gbuffer.h), whole rows from one on; those of a group behind
// the last are read, and mean nothing.
struct bd_native_pixels {
    const float *depth, *normals;
    const uint16_t *albedo, *material;
    const uint32_t *triangle;
    const struct bd_view *view;
    uint32_t first_row, count;
};

// Where they are in a face of a light's shadow map, texels; and how long one is there.
struct bd_native_texels {
    float x[BD_LANES], y[BD_LANES], side[BD_LANES];
};

// A group of pixels that a light shines on if nothing stands between. A light of one face has
// LIGHT_ONE_FACE (kernel/light.h).
struct bd_native_aim {
    struct bd_lanes3 irradiance, radiance; // that they would get and reflect
    struct bd_lanes3 origin, span;
    struct bd_native_texels texel;
    uint32_t is_lit[BD_LANES], face[BD_LANES], triangle[BD_LANES];
};

// Pixels and triangles that may stand before them, and what is to be said of those: light may pass
// there; it does not; nor where others as small do.
#define BD_PAIR_OPENS  1u
#define BD_PAIR_HIDES  2u
#define BD_PAIR_STANDS 4u
struct bd_native_pairs {
    struct bd_lanes3 origin, span, corner, edge1, edge2;
    float texel_side[BD_LANES];
};

// A screen (shared/screen.h). What args say of the device's slices is not read.
struct bd_native_screen {
    const struct bd_screen_part *parts;
    const struct bd_screen_patch *patches;
    struct bd_screen_args args;
    bool printed; // paper_mode
};

// Pixels of a block, a lane each, and where they look.
#define BD_SCREEN_LANES (BD_SCREEN_BLOCK_SIDE * BD_SCREEN_BLOCK_SIDE)
struct bd_screen_receivers {
    float x[BD_SCREEN_LANES], y[BD_SCREEN_LANES], z[BD_SCREEN_LANES];
    float normal_x[BD_SCREEN_LANES], normal_y[BD_SCREEN_LANES], normal_z[BD_SCREEN_LANES];
    float geometric_x[BD_SCREEN_LANES], geometric_y[BD_SCREEN_LANES], geometric_z[BD_SCREEN_LANES];
    float lit[BD_SCREEN_LANES]; // 1, or 0: it asks for nothing
    struct bd_uvec4 bounds;
};
// Their surfaces, whose lobes are asked for.
struct bd_screen_surfaces {
    float viewer_x[BD_SCREEN_LANES], viewer_y[BD_SCREEN_LANES], viewer_z[BD_SCREEN_LANES];
    float red[BD_SCREEN_LANES], green[BD_SCREEN_LANES], blue[BD_SCREEN_LANES];
    float metallic[BD_SCREEN_LANES], roughness[BD_SCREEN_LANES], f0_dielectric[BD_SCREEN_LANES];
    float has_lobe[BD_SCREEN_LANES]; // 1, less where it grazes, or 0: none that is worth its price
};
// Irradiance, what it would be of a radiance of 1, and how many parts were looked at for it.
struct bd_screen_light {
    float red[BD_SCREEN_LANES], green[BD_SCREEN_LANES], blue[BD_SCREEN_LANES];
    float given[BD_SCREEN_LANES];
    float looked[BD_SCREEN_LANES];
    // What lobes reflect beyond the diffuse one, and would of a radiance of 1.
    float lobe_red[BD_SCREEN_LANES], lobe_green[BD_SCREEN_LANES], lobe_blue[BD_SCREEN_LANES];
    float reflected[BD_SCREEN_LANES];
};

// A map of what a virtual light sees of some points (shared/imperfect_shadows.h).
struct bd_native_shadow {
    const struct bd_shadow_centre *centre;
    const struct bd_shadow_point *points;
    uint32_t count, side_px;
};

// A place that points are projected to, the axes of its map, the last of which is its normal, and a
// number that others have not.
struct bd_native_place {
    f3 position, across, along, normal;
    uint32_t chance;
};

// Points side by side, a lane each, and the area that each stands for; those behind `count` mean
// nothing.
struct bd_native_points {
    struct bd_projected_point points[BD_LANES];
    uint32_t names[BD_LANES]; // that points keep, by which they draw
    float area[BD_LANES];
    uint32_t count;
};

// Of what a place sees, so many texels along a side; points cover them as the paper has it, or as
// they should.
struct bd_native_map {
    uint32_t *keys;
    uint32_t side;
    bool as_printed;
};

// What is summed beside irradiance.
struct bd_native_wishes {
    bool near_patches;   // VPLs nearer than their limit are integrated as patches
    bool vector, spread; // a group without blocks is spared its spread
};

struct bd_native_loops {
    const char *width; // of vectors: "baseline" (SSE2 on x86), "avx2", "avx512"
    // Nodes of a tree, side by side: leaves,
    void (*make_leaves)(const struct bd_native_leaves *leaves, struct bd_vec4 *nodes);
    // and at most BD_LANES inner ones, of four children each.
    void (*join_nodes)(const struct bd_vec4 *children, uint32_t count, struct bd_vec4 *nodes);
    // Adds the light of the VPLs, in their order, to that of a group.
    void (*gather)(const struct bd_receivers *receivers, const struct bd_native_vpls *vpls,
                   const struct bd_native_hidden *hidden, const struct bd_native_wishes *wishes,
                   struct bd_receiver_light *light);
    // Adds what the lanes' specular lobes reflect of them beyond the diffuse lobe
    // (kernel/brdf.h), where they are worth their price.
    void (*gather_glossy)(const struct bd_receivers *receivers,
                          const struct bd_glossy_receivers *surfaces,
                          const struct bd_native_vpls *vpls, const struct bd_native_hidden *hidden,
                          const struct bd_native_wishes *wishes, struct bd_lanes3 *light);
    // Adds what the tree's roots by themselves send to each lane, in whole steps.
    void (*estimate)(const struct bd_receivers *receivers, const struct bd_native_tree *tree,
                     uint32_t steps[BD_LANES]);
    // Adds the light of a cut of the tree to each lane; `steps` of all lights.
    void (*gather_tree)(const struct bd_receivers *receivers, const struct bd_native_tree *tree,
                        const struct bd_native_wishes *wishes, const uint32_t steps[BD_LANES],
                        struct bd_receiver_light *light);
    // Running sums over a part of the groups of VPLs, which follows on the one before: into `sums`,
    // a float of each lane for each group of VPLs; and adds to the lanes' spread.
    void (*weigh)(const struct bd_receivers *receivers, const struct bd_native_choice *choice,
                  const struct bd_native_wishes *wishes, const struct bd_native_part *groups,
                  float *sums, struct bd_receiver_light *light);
    // Chooses by those, for a part of the rays: a pick a ray.
    void (*choose)(const struct bd_receivers *receivers, const struct bd_ray_starts *starts,
                   const struct bd_native_choice *choice, const struct bd_native_wishes *wishes,
                   const struct bd_native_part *rays, const float *sums,
                   struct bd_native_pick *picks);
    // Sums those whose segments are not occluded: all, and half the difference of those at even and
    // at odd places.
    void (*sum_picks)(const struct bd_receivers *receivers, const struct bd_native_pick *picks,
                      uint32_t rays, const uint32_t *occluded, struct bd_receiver_light *light);
    // What a light would give to the group of pixels from `first` on, and where to look;
    void (*aim)(const struct bd_native_pixels *pixels, uint32_t first,
                const struct bd_light_uniform *light, bool lambert, struct bd_native_aim *aim);
    // and what triangles say.
    void (*ask)(const struct bd_native_pairs *pairs, uint32_t said[BD_LANES]);
    // What the screen gives to each lane beyond the clamp, added to zeroes. `surfaces` NULL: no
    // lobe is asked for.
    void (*residual)(const struct bd_native_screen *screen,
                     const struct bd_screen_receivers *receivers,
                     const struct bd_screen_surfaces *surfaces, struct bd_screen_light *light);
    // Keeps in each texel of a map the least key of the disks that it meets.
    void (*shadow)(const struct bd_native_shadow *shadow, uint32_t *map);
    // What a place may get of points (kernel/projected_point.h).
    void (*weigh_points)(const struct bd_native_place *place, const struct bd_native_points *points,
                         bool as_printed, float importance[BD_LANES]);
    // Keeps in each texel of a map the least key of points, whose slots go on from `first_slot`;
    // and of each point 1 if it turns its back on the place.
    void (*project)(const struct bd_native_place *place, const struct bd_native_points *points,
                    uint32_t first_slot, const struct bd_native_map *map,
                    uint32_t turns_away[BD_LANES]);
};

// The widest that this machine has, or none wider than BD_NATIVE_WIDTH of the environment says:
// for tests, whose pictures are the same.
const struct bd_native_loops *bd_native_loops(void);
// By index, for tests; NULL behind the last, and for those that this machine has not.
const struct bd_native_loops *bd_native_loops_at(uint32_t index, const char **width);

#endif
