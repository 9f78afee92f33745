// The two questions of rays/rays.h as they lie in a buffer, segments whose ends see each other or
// not and rays that meet something first; and the triangles that both are asked of, as a device has
// them (rays/nodes.h).
#ifndef BD_SHARED_RAYS_H
#define BD_SHARED_RAYS_H

#include "shared/types.h"

// Two uvec4s: bits of xyz and a triangle's number, for each of the two ends.
#define BD_SEGMENT_UVEC4S 2
#define BD_NO_TRIANGLE    0xffffffffu

// What lies nearer to an end than this many times the larger of the ends' coordinates does not
// block: sixteen units in the last place.
#define BD_RAY_BIAS 1.9073486e-6f

#ifndef BD_GLSL
struct bd_segment {
    float from[3];
    uint32_t from_triangle; // or BD_NO_TRIANGLE: neither end's triangle blocks
    float to[3];
    // Where maps are asked (pass/imperfect_shadows.h), the map of a VPL; `to` is the receiver's
    // normal.
    uint32_t to_triangle;
};
_Static_assert(sizeof(struct bd_segment) == 16 * BD_SEGMENT_UVEC4S, "std430 size");
#endif

// Three uvec4s: bits of the origin's xyz, a triangle's number; of the direction's, of the far end;
// of the near end, 1 where backs are passed.
#define BD_RAY_UVEC4S 3
// A uvec4: a triangle's number, bits of the rest.
#define BD_RAY_HIT_UVEC4S 1
// Behind a triangle that is met a ray goes on by this part of its way: a box is as near as its
// triangle but for rounding, and another one as near is to be come to whatever the tree.
#define BD_RAY_BEHIND 0.000244140625f // 2^-12

#ifndef BD_GLSL
struct bd_ray {
    float origin[3];
    uint32_t from_triangle; // or BD_NO_TRIANGLE
    float direction[3];     // of any length from 1e-18
    float far;              // in lengths of the direction; may be INFINITY
    float near;             // the same; nothing before it is met. 0: within BD_RAY_BIAS, as above
    uint32_t passes_backs;  // 1: of single-sided triangles, as rays of a camera do; else 0
    uint32_t unused[2];
};
struct bd_ray_hit {
    uint32_t triangle; // BD_NO_TRIANGLE: none, and the rest is 0
    float u, v;        // of the second and third corner
    float distance;    // in lengths of the direction
};
_Static_assert(sizeof(struct bd_ray) == 16 * BD_RAY_UVEC4S, "std430 size");
_Static_assert(sizeof(struct bd_ray_hit) == 16 * BD_RAY_HIT_UVEC4S, "std430 size");
#endif

// Nodes of a binary tree, each before what is below it, its first child next to it: what is not
// looked into is passed over by going on at `skip`, so a walk needs no stack.
// Two uvec4s: bits of xyz of the box's least corner, skip; of its greatest, leaf.
#define BD_RAY_NODE_UVEC4S 2
// A leaf: its first triangle, times this, plus how many there are. Any other node: 0.
#define BD_RAY_LEAF_COUNTS 8u
// Three uvec4s: bits of xyz of each corner; behind the first the triangle's number, behind the
// second 0 where it is opaque, else 1 + its place among those that are not; behind the third, what
// passes its back.
#define BD_RAY_TRIANGLE_UVEC4S 3
#define BD_RAY_BACK_NONE       0u // it has two sides
#define BD_RAY_BACK_BEFORE     1u // a ray along its corners' normal, (b - a) x (c - a)
#define BD_RAY_BACK_AGAINST    2u // a ray against that

// What is not opaque: a table of materials, then of triangles.
// Of a material, three uvec4s: flags, bits of the alpha from which on it is there, of its factor,
// place of its map's first texel, a byte each; the map's size, bits of its transform's first two
// numbers; of the other four.
#define BD_CUTOUT_MATERIAL_UVEC4S 3
#define BD_CUTOUT_BLENDS          1u
#define BD_CUTOUT_NEAREST         2u
#define BD_CUTOUT_WRAP_S          4u // times enum bd_wrap
#define BD_CUTOUT_WRAP_T          16u
#define BD_CUTOUT_WRAP_REPEAT     0u
#define BD_CUTOUT_WRAP_CLAMP      1u
#define BD_CUTOUT_WRAP_MIRROR     2u
// Of a triangle, a uvec4 a corner: bits of its texture coordinates and of its colour's alpha;
// behind those the material's place, 1 if it has a map, 1 if it has a colour.
#define BD_CUTOUT_TRIANGLE_UVEC4S 3

#ifndef BD_GLSL
struct bd_ray_node {
    float least[3];
    uint32_t skip;
    float most[3];
    uint32_t leaf;
};
struct bd_ray_triangle {
    float a[3];
    uint32_t number;
    float b[3];
    uint32_t cutout;
    float c[3];
    uint32_t back; // BD_RAY_BACK_*
};
_Static_assert(sizeof(struct bd_ray_node) == 16 * BD_RAY_NODE_UVEC4S, "std430 size");
_Static_assert(sizeof(struct bd_ray_triangle) == 16 * BD_RAY_TRIANGLE_UVEC4S, "std430 size");
#endif

// Arguments of pass/visibility, for either question.
struct bd_ray_walk_args {
    BD_UINT first_ray;      // or segment, of the slice; a multiple of 64
    BD_UINT end_ray;        // the one behind its last
    BD_UINT node_count;     // of the tree
    BD_UINT look_count_max; // nodes and triangles that an invocation may look at

    BD_UINT is_first_round;        // 1: walks begin; 0: they go on where they were
    BD_UINT alpha_is_coverage;     // 1: what blends is there by chance
    BD_UINT first_cutout_triangle; // the first that is not opaque, in the table of those
    BD_UINT unused_0;
};
// What pass/visibility counts.
#define BD_RAY_COUNT_ASKED      0 // rays, and segments that have a length
#define BD_RAY_COUNT_UNFINISHED 1 // whose walks have not ended
#define BD_RAY_COUNTS           2

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_ray_walk_args) == 32, "std140 size");
#endif

#endif
