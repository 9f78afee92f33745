// What pass/surfaces left of blocks. `level` is as in bd_multires_layout.
#include "common/multires.glsl"
#include "shared/bindings.h"
#include "shared/surfaces.h"

layout(binding = BD_UNIT_BLOCK_SURFACES) uniform usampler2D surfaces;

// Whether all is of one surface around a block, and neither it nor a neighbour is cut by the picture's
// edge.
bool is_inner(bd_multires_level level, ivec2 block)
{
    if (!multires_has(level, uvec2(block))) return false;
    return (texelFetch(surfaces, multires_texel(level, uvec2(block)), 0).x & BD_SURFACES_INNER) != 0u;
}
