// What the kernels of surfaces ask of a block. Levels are as in the arguments; before the first row or
// column a block's number wraps, and no level has such a block.
#include "common/multires.glsl"
#include "common/one_surface.glsl"
#include "shared/surfaces.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_surfaces_args args; };
layout(binding = BD_UNIT_BLOCK_FLAGS) uniform usampler2D flags;
layout(binding = BD_UNIT_BLOCK_REPRESENTATIVE) uniform usampler2D representative;

uint flag_of(uvec4 level, ivec2 block)
{
    if (!multires_has(level, uvec2(block))) return BD_BLOCK_EMPTY;
    if (level.w > 0u) return texelFetch(flags, multires_texel(level, uvec2(block)), 0).x;
    bool lit = material_is_lit(texelFetch(gbuffer_material, block, 0));
    return lit ? BD_BLOCK_SMOOTH : BD_BLOCK_EMPTY;
}

// Blocks that are not split hold light whatever is in them.
bool holds_light(uvec4 level, uint flag)
{
    return flag == BD_BLOCK_SMOOTH || (flag == BD_BLOCK_DISCONTINUOUS && level.w <= args.rows.z);
}

receiver receiver_of(uvec4 level, ivec2 block)
{
    uint pixel = BD_PIXEL_PACK(uint(block.x), uint(block.y));
    if (level.w > 0u) pixel = texelFetch(representative, multires_texel(level, uvec2(block)), 0).x;
    return gbuffer_receiver(ivec2(BD_PIXEL_X(pixel), BD_PIXEL_Y(pixel)));
}

