// Which VPLs a receiver asks about: segments from receivers to VPLs, for pass/visibility.h.

#ifndef BD_PASS_CHOOSE_H
#define BD_PASS_CHOOSE_H

#include "pass/gbuffer.h"
#include "pass/visibility.h"
#include "pass/vpl_grid.h"

struct bd_choose_inputs {
    const struct bd_gbuffer *gbuffer;
    const struct bd_view *view;
    const struct bd_vpl_list *list;
    bool near_patches; // as bd_gather_inputs
};

// Pixels of a tile whose segments to so many VPLs fit; at least 64.
uint32_t bd_choose_all_pixels_max(uint32_t vpl_count);

// Every pixel of the tile asks about every VPL of the range. Pixels in rows; of each, 32 segments
// for each word of answers, VPLs in order.
BD_MUST_CHECK
enum bd_err bd_choose_all(const struct bd_pass_context *context,
                          const struct bd_choose_inputs *inputs, const struct bd_tile *tile,
                          uint32_t first_vpl, uint32_t vpl_count, struct bd_segments *segments,
                          struct bd_fault *fault);

#endif
