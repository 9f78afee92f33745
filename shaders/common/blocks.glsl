// Blocks of a multiresolution image (shared/multires.h).
#include "shared/bindings.h"
#include "shared/multires.h"

layout(std140, binding = BD_UNIFORM_MULTIRES) uniform multires_block { bd_multires_layout multires; };

uint coarsest_level() { return multires.level_count - 1u; }

ivec2 blocks_of_level(uint level) { return ivec2(multires.levels[level].columns, multires.levels[level].rows); }

// Where block (x, y) of a level from 1 on lies in the stack.
ivec2 in_stack(uint level, ivec2 block) { return block + ivec2(0, int(multires.levels[level].first_row)); }

// First and last pixel of a block; the picture's edge cuts it.
ivec4 pixels_of_block(uint level, ivec2 block)
{
    ivec2 end = min((block + 1) << int(level), ivec2(uvec2(multires.width_px, multires.height_px)));
    return ivec4(block << int(level), end - 1);
}

// Of what is left of a block, in pixels.
vec2 centre_of_block(uint level, ivec2 block)
{
    ivec4 pixels = pixels_of_block(level, block);
    return 0.5 * vec2(pixels.xy + pixels.zw + 1);
}
