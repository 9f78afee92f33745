// Levels from 2 on: a block's measures from its four children's, and its own test.
#include "pass/discontinuity/measures.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = BD_UNIT_FINER_DEPTH) uniform sampler2D finer_depth;
layout(binding = BD_UNIT_FINER_NORMAL) uniform sampler2D finer_normal;
layout(binding = BD_UNIT_FINER_NORMAL_LEAST) uniform sampler2D finer_normal_least;
layout(binding = BD_IMAGE_OWN_TESTS, r32ui) uniform uimage2D own;

void add_child(inout measures m, ivec2 child)
{
#if BD_DEPTH_TEST != BD_TEST_NONE
    m.depth = max(m.depth, texelFetch(finer_depth, child, 0).DEPTH_SWIZZLE);
#endif
#if BD_NORMAL_TEST != BD_TEST_NONE
    m.normal = max(m.normal, texelFetch(finer_normal, child, 0).NORMAL_SWIZZLE);
#endif
#if BD_NORMAL_TEST == BD_TEST_RANGE
    m.normal_least = max(m.normal_least, texelFetch(finer_normal_least, child, 0).xyz);
#endif
}

void main()
{
    uvec4 level = args.multires.levels[args.slice.z];
    uvec2 block = gl_GlobalInvocationID.xy + uvec2(0u, args.slice.x);
    if (gl_GlobalInvocationID.y >= args.slice.y || !multires_has(level, block)) return;
    uvec4 finer = args.multires.levels[args.slice.z - 1u];
    measures m = MEASURES_OF_NOTHING;
    uint bits = 0u;
    for (uint i = 0u; i < 4u; i++) {
        uvec2 child = block * 2u + uvec2(i & 1u, i >> 1u);
        if (!multires_has(finer, child)) continue;
        bits |= imageLoad(own, multires_texel(finer, child)).x & (BD_OWN_LIT | BD_OWN_UNLIT);
        add_child(m, ivec2(child));
    }
    store_measures(block, m);
    imageStore(own, multires_texel(level, block), uvec4(bits | own_test(m, bits)));
}
