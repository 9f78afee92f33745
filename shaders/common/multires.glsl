// Access to the levels of a multiresolution image; `level` is an entry of
// bd_multires_layout.levels.
#include "shared/multires.h"

bool multires_has(uvec4 level, uvec2 block) { return all(lessThan(block, level.xy)); }

// Of a block of level 1 or coarser, in the textures that stack them.
ivec2 multires_texel(uvec4 level, uvec2 block) { return ivec2(block.x, block.y + level.z); }
