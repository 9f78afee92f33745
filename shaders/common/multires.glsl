// Access to the levels of a multiresolution image; `level` is an entry of
// bd_multires_layout.levels.
#include "shared/multires.h"

bool multires_has(uvec4 level, uvec2 block) { return all(lessThan(block, level.xy)); }

// Which level it is; of an argument that bd_multires_level made (pass/multires_layout.h).
uint multires_number(uvec4 level) { return level.w; }

// Of a block of level 1 or coarser, in the textures that stack them.
ivec2 multires_texel(uvec4 level, uvec2 block) { return ivec2(block.x, block.y + level.z); }
