// What the passes have in common that make VPLs from blocks of a light's map
// (shaders/common/vpl_block.glsl).

#ifndef BD_PASS_VPL_BLOCK_H
#define BD_PASS_VPL_BLOCK_H

#include "pass/vpl_grid.h"
#include "shared/vpl_block.h"

// In the slicer's unit, an evaluation of a VPL: three walks over the texels.
#define BD_VPL_BLOCK_UNITS_PER_TEXEL 12.0
// Blocks with a longer side get a work group each. At 32 a member would have one texel.
#define BD_VPL_BLOCK_SOLITARY_SIDE_MAX 32u

struct bd_vpl_block_args bd_vpl_block_args(const struct bd_rsm *rsm, uint32_t face,
                                           enum bd_vpl_kernel kernel, double near_field);
// Binds the map to be read and the list to be written.
void bd_vpl_block_bind(const struct bd_rsm *rsm, const struct bd_vpl_list *list,
                       struct bd_bindings *bindings);

#endif
