// What is known of a block's pixels that can be lit, and its own test. Every measure is a maximum, so
// that a coarser block's is the maximum of its children's: a least value is kept negative.
//
// BD_DEPTH_TEST and BD_NORMAL_TEST pick what is measured, and no more is.
//
// Normals are shading normals alone. The light that a fragment sums varies over its block with them;
// the geometric one only cuts off what lies below the surface. On a curved surface made of triangles
// it jumps at every edge, where light does not, and fragments would follow the tessellation.
#include "common/multires.glsl"
#include "shared/bindings.h"
#include "shared/discontinuity.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_discontinuity_args args; };

#if BD_DEPTH_TEST == BD_TEST_RANGE
#define DEPTH_TYPE    vec2 // greatest depth, negative least depth
#define DEPTH_FORMAT  rg32f
#define DEPTH_SWIZZLE xy
const vec2 DEPTH_OF_NOTHING = vec2(-3e38);
#else
#define DEPTH_TYPE    float // greatest slope, or step
#define DEPTH_FORMAT  r32f
#define DEPTH_SWIZZLE x
const float DEPTH_OF_NOTHING = 0.0;
#endif

#if BD_NORMAL_TEST == BD_TEST_RANGE
#define NORMAL_TYPE    vec3 // greatest components; negative least ones are kept apart
#define NORMAL_FORMAT  rgba32f
#define NORMAL_SWIZZLE xyz
const vec3 NORMAL_OF_NOTHING = vec3(-3e38);
#else
#define NORMAL_TYPE    float // greatest chord
#define NORMAL_FORMAT  r32f
#define NORMAL_SWIZZLE x
const float NORMAL_OF_NOTHING = 0.0;
#endif

struct measures {
    DEPTH_TYPE depth;
    NORMAL_TYPE normal;
    vec3 normal_least; // negative least components
};

const measures MEASURES_OF_NOTHING = measures(DEPTH_OF_NOTHING, NORMAL_OF_NOTHING, vec3(-3e38));

#if BD_DEPTH_TEST != BD_TEST_NONE
layout(binding = BD_IMAGE_DEPTH_MEASURES, DEPTH_FORMAT) writeonly uniform image2D depth_measures;
#endif
#if BD_NORMAL_TEST != BD_TEST_NONE
layout(binding = BD_IMAGE_NORMAL_MEASURES, NORMAL_FORMAT) writeonly uniform image2D normal_measures;
#endif
#if BD_NORMAL_TEST == BD_TEST_RANGE
layout(binding = BD_IMAGE_NORMAL_LEAST_MEASURES, rgba32f) writeonly uniform image2D normal_least_measures;
#endif

vec4 four(float v) { return vec4(v, 0.0, 0.0, 0.0); }
vec4 four(vec2 v) { return vec4(v, 0.0, 0.0); }
vec4 four(vec3 v) { return vec4(v, 0.0); }

// For the level above: each level has its own corner of the two textures that take turns.
void store_measures(uvec2 block, measures m)
{
#if BD_DEPTH_TEST != BD_TEST_NONE
    imageStore(depth_measures, ivec2(block), four(m.depth));
#endif
#if BD_NORMAL_TEST != BD_TEST_NONE
    imageStore(normal_measures, ivec2(block), four(m.normal));
#endif
#if BD_NORMAL_TEST == BD_TEST_RANGE
    imageStore(normal_least_measures, ivec2(block), four(m.normal_least));
#endif
}

// What a block is by itself. A threshold is met by more, not by as much. `word` has the block's children
// and whether it has pixels that cannot be lit.
uint own_kind(measures m, uint word)
{
    if (BD_BLOCK_CHILDREN(word) == 0u) return BD_BLOCK_EMPTY;
    bool jump = false;
#if BD_DEPTH_TEST == BD_TEST_RANGE
    float least = -m.depth.y, scale = args.depth_scale > 0.0 ? args.depth_scale : least;
    jump = m.depth.x - least > args.depth_threshold * scale;
#elif BD_DEPTH_TEST != BD_TEST_NONE
    jump = m.depth > args.depth_threshold;
#endif
#if BD_DEPTH_TEST != BD_TEST_NONE
    // What cannot be lit lies behind, or is no surface of this kind: a silhouette (hazard 30).
    jump = jump || (word & BD_BLOCK_HAS_UNLIT) != 0u;
#endif
#if BD_NORMAL_TEST == BD_TEST_RANGE
    jump = jump || any(greaterThan(m.normal + m.normal_least, vec3(args.normal_threshold)));
#elif BD_NORMAL_TEST == BD_TEST_JUMP
    jump = jump || m.normal > args.normal_threshold;
#endif
    return jump ? BD_BLOCK_DISCONTINUOUS : BD_BLOCK_SMOOTH;
}
