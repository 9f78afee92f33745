// Levels from 2 on: a block's measures from its four children's, and what it is by itself; or where no
// neighbours are asked what it is at last, by its children, too, which makes the property monotone
// (errata N5).
#include "pass/discontinuity/measures.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = BD_UNIT_FINER_DEPTH) uniform sampler2D finer_depth;
layout(binding = BD_UNIT_FINER_NORMAL) uniform sampler2D finer_normal;
layout(binding = BD_UNIT_FINER_NORMAL_LEAST) uniform sampler2D finer_normal_least;
layout(binding = BD_IMAGE_WORDS, r32ui) uniform uimage2D words;

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
    bd_multires_level level = args.multires.levels[args.level];
    uvec2 block = gl_GlobalInvocationID.xy + uvec2(0u, args.first_row);
    if (gl_GlobalInvocationID.y >= args.row_count || !multires_has(level, block)) return;
    bd_multires_level finer = args.multires.levels[args.level - 1u];
    measures m = MEASURES_OF_NOTHING;
    uint word = 0u;
    bool below = false;
    for (uint i = 0u; i < 4u; i++) {
        uvec2 child = block * 2u + uvec2(i & 1u, i >> 1u);
        if (!multires_has(finer, child)) continue;
        uint of_child = imageLoad(words, multires_texel(finer, child)).x, kind = BD_BLOCK_KIND(of_child);
        word |= of_child & BD_BLOCK_HAS_UNLIT;
        if (kind != BD_BLOCK_EMPTY) word |= BD_BLOCK_WITH_CHILD(i);
        below = below || kind == BD_BLOCK_DISCONTINUOUS;
        add_child(m, ivec2(child));
    }
    store_measures(block, m);
    uint kind = below && args.neighbour_count == 0u ? BD_BLOCK_DISCONTINUOUS : own_kind(m, word);
    imageStore(words, multires_texel(level, block), uvec4(word | kind));
}
