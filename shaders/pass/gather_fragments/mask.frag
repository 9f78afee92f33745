// Covers, at the depth nearest of all, what is no fragment (algorithms.md A2.1).
#include "common/block_at.glsl"
#include "common/fragment_mask.glsl"

void main()
{
    block_at at = block_at_texel(ivec2(gl_FragCoord.xy));
    if (at.exists && is_fragment(at.level, at.block)) discard;
}
