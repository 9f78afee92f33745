// Covers, at the depth nearest of all, what is no fragment: a block that is empty or discontinuous,
// or lies in a smooth one (algorithms.md A2.1).
#include "common/block_at.glsl"
#include "common/gbuffer.glsl"

layout(binding = BD_UNIT_BLOCK_FLAGS) uniform usampler2D flags;

bool is_smooth(uint level, ivec2 block)
{
    if (level == 0u) return gbuffer_receiver(block).lit;
    return texelFetch(flags, in_stack(level, block), 0).x == BD_BLOCK_SMOOTH;
}

bool is_fragment(uint level, ivec2 block)
{
    if (!is_smooth(level, block)) return false;
    if (level == coarsest_level()) return true;
    return texelFetch(flags, in_stack(level + 1u, block >> 1), 0).x == BD_BLOCK_DISCONTINUOUS;
}

void main()
{
    block_at at = block_at_texel(ivec2(gl_FragCoord.xy));
    if (at.exists && is_fragment(at.level, at.block)) discard;
}
