// Gather behind a mask (Nichols, Shopf and Wyman 2009, 3.2): runs only where the depth test lets a
// fragment through.
#include "common/block_at.glsl"
#include "common/fragment_gather.glsl"

layout(early_fragment_tests) in;

void main()
{
    block_at at = block_at_texel(ivec2(gl_FragCoord.xy));
    if (at.exists) gather_at(at.level, at.block, 0u);
}
