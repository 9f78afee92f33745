// Gather with a few rays: every pixel weighs all VPLs, and asks after some of them, chosen in
// proportion to what they would give it (pass/choose.h), whether it sees them.

#ifndef BD_PASS_GATHER_CHOSEN_H
#define BD_PASS_GATHER_CHOSEN_H

#include "pass/gather.h"

struct bd_gather_chosen_inputs {
    const struct bd_gather_inputs *gather; // with visibility; its lists are not read
    const struct bd_vpl_list *list;        // of all lights, in order (pass/vpl_order.h); not empty
    uint32_t rays;                         // a pixel, at most BD_RAYS_CHOSEN_MAX
    uint64_t seed;
};

// With `noise`, and `noise_glossy` where receivers are glossy.
BD_MUST_CHECK
enum bd_err bd_gather_chosen_run(const struct bd_pass_context *context,
                                 const struct bd_gather_chosen_inputs *inputs,
                                 struct bd_indirect **out, struct bd_err_detail *detail);

#endif
