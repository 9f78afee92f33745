// What the kernels of surfaces ask of a block. Levels are as in the arguments; before the first row or
// column a block's number wraps, and no level has such a block.
#include "common/one_surface.glsl"
#include "pass/surfaces/lists.glsl"

layout(binding = BD_UNIT_BLOCK_FLAGS) uniform usampler2D flags;
layout(binding = BD_UNIT_BLOCK_REPRESENTATIVE) uniform usampler2D representative;

// As in the texture of flags, of levels from 1 on; that of an empty block where there is none.
uint flags_of(bd_multires_level level, ivec2 block)
{
    if (!multires_has(level, uvec2(block))) return BD_BLOCK_EMPTY;
    return texelFetch(flags, multires_texel(level, uvec2(block)), 0).x;
}

// Of a block that is not empty.
receiver receiver_of(bd_multires_level level, ivec2 block)
{
    uint pixel = BD_PIXEL_PACK(uint(block.x), uint(block.y));
    if (multires_number(level) > 0u) pixel = texelFetch(representative, multires_texel(level, uvec2(block)), 0).x;
    return gbuffer_receiver(unpacked(pixel));
}
