// One VPL for each block of a regular grid over a light's reflective shadow map.
#include "shared/bindings.h"
#include "shared/vpl_grid.h"

#ifdef BD_GROUP_PER_VPL
layout(local_size_x = 1024) in;
#else
layout(local_size_x = 8, local_size_y = 8) in;
#endif
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_vpl_grid_args args; };

#include "common/vpl_block.glsl"

// First texel of a block's row or column; the last block ends at the map's side.
int first_texel(uint block) { return int(block * light.face_side_px / args.grid_side); }

void main()
{
#ifdef BD_GROUP_PER_VPL
    uvec2 cell = gl_WorkGroupID.xy;
#else
    uvec2 cell = gl_GlobalInvocationID.xy;
#endif
    if (cell.x >= args.grid_side || cell.y >= args.row_count) return;
    cell.y += args.first_row;
    uint index = (args.block.face * args.grid_side + cell.y) * args.grid_side + cell.x;
    make_vpl(ivec2(first_texel(cell.x), first_texel(cell.y)),
             ivec2(first_texel(cell.x + 1u), first_texel(cell.y + 1u)), index);
}
