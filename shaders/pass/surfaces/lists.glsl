// Arguments and counts of the kernels of surfaces.
#include "common/multires.glsl"
#include "shared/bindings.h"
#include "shared/surfaces.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_surfaces_args args; };
// Of a level: x = blocks to be looked at, y = outer ones.
layout(std430, binding = BD_STORAGE_SURFACE_COUNTS) buffer count_block { uvec2 counts[]; };

// Blocks that are not split hold light whatever is in them.
bool holds_light(bd_multires_level level, uint kind)
{
    return kind == BD_BLOCK_SMOOTH || (kind == BD_BLOCK_DISCONTINUOUS && multires_number(level) <= args.finest_level);
}

// Of a list, the place of this invocation.
bool is_in_list() { return gl_GlobalInvocationID.x < args.item_count; }
uint place_in_list() { return args.first_item + gl_GlobalInvocationID.x; }
ivec2 unpacked(uint block) { return ivec2(BD_PIXEL_X(block), BD_PIXEL_Y(block)); }
