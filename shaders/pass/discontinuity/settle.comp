// Flags of one level, from the finest up, where neighbours are asked: by own tests, the neighbours', and
// the children's flags, which makes the property monotone (errata N5).
//
// Loops that end at once, where a branch would do: the software device runs both sides of those.
#include "common/multires.glsl"
#include "shared/bindings.h"
#include "shared/discontinuity.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_discontinuity_args args; };
layout(binding = BD_UNIT_OWN_TESTS) uniform usampler2D own_tests;
layout(binding = BD_IMAGE_WORDS, r32ui) uniform uimage2D flags;

bool jumps(bd_multires_level level, uvec2 block)
{
    if (!multires_has(level, block)) return false;
    return BD_BLOCK_KIND(texelFetch(own_tests, multires_texel(level, block), 0).x) == BD_BLOCK_DISCONTINUOUS;
}

const ivec2 NEIGHBOURS[8] = ivec2[8](ivec2(-1, -1), ivec2(1, -1), ivec2(-1, 1), ivec2(1, 1),
                                     ivec2(0, -1), ivec2(-1, 0), ivec2(1, 0), ivec2(0, 1));

bool neighbour_jumps(bd_multires_level level, uvec2 block)
{
    bool found = false;
    // Beyond the first row or column the number wraps, and the level has no such block.
    for (uint i = 0u; i < args.neighbour_count; i++)
        found = found || jumps(level, uvec2(ivec2(block) + NEIGHBOURS[i]));
    return found;
}

bool child_is_discontinuous(uvec2 block)
{
    bd_multires_level finer = args.multires.levels[args.level - 1u];
    uint children = args.level > 1u ? 4u : 0u; // pixels are not
    bool found = false;
    for (uint i = 0u; i < children; i++) {
        uvec2 child = block * 2u + uvec2(i & 1u, i >> 1u);
        if (multires_has(finer, child))
            found = found ||
                    BD_BLOCK_KIND(imageLoad(flags, multires_texel(finer, child)).x) == BD_BLOCK_DISCONTINUOUS;
    }
    return found;
}

void main()
{
    bd_multires_level level = args.multires.levels[args.level];
    uvec2 block = gl_GlobalInvocationID.xy + uvec2(0u, args.first_row);
    if (gl_GlobalInvocationID.y >= args.row_count || !multires_has(level, block)) return;
    ivec2 texel = multires_texel(level, block);
    uint word = texelFetch(own_tests, texel, 0).x;
    bool found = BD_BLOCK_KIND(word) == BD_BLOCK_SMOOTH &&
                 (child_is_discontinuous(block) || neighbour_jumps(level, block));
    imageStore(flags, texel, uvec4(found ? word - BD_BLOCK_SMOOTH + BD_BLOCK_DISCONTINUOUS : word));
}
