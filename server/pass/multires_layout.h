// The levels of a multiresolution image (shared/multires.h). Any thread; no device.

#ifndef BD_PASS_MULTIRES_LAYOUT_H
#define BD_PASS_MULTIRES_LAYOUT_H

#include <stdint.h>

#include "shared/multires.h"

// Levels from the pixels up to the first that has at most `coarsest_side` blocks along its longer
// side. Width and height 1 .. 16384, coarsest_side at least 1.
struct bd_multires_layout bd_multires_layout_of(uint32_t width_px, uint32_t height_px,
                                                uint32_t coarsest_side);

// Blocks of all levels together: no list of fragments is longer than level 0's share of it.
uint64_t bd_multires_block_count(const struct bd_multires_layout *layout);

// An entry of the layout's levels with its number; of no blocks behind the coarsest.
struct bd_multires_level bd_multires_level(const struct bd_multires_layout *layout, uint32_t level);

// Size of the texture that stacks the levels from 1 on; 1 x 1 if there are none.
void bd_multires_stack_size(const struct bd_multires_layout *layout, uint32_t *width_px,
                            uint32_t *height_px);

#endif
