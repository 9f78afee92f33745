// Access to the levels of a multiresolution image; `level` is an entry of
// bd_multires_layout.levels.
#include "shared/multires.h"

uvec2 multires_size(bd_multires_level level) { return uvec2(level.columns, level.rows); }

bool multires_has(bd_multires_level level, uvec2 block) { return all(lessThan(block, multires_size(level))); }

// Which level it is; of an argument that bd_multires_level made (pass/multires_layout.h).
uint multires_number(bd_multires_level level) { return level.number; }

// Of a block of level 1 or coarser, in the textures that stack them.
ivec2 multires_texel(bd_multires_level level, uvec2 block) { return ivec2(block.x, block.y + level.first_row); }
