// Gather with a few rays: every pixel weighs all VPLs, and asks after some of them, chosen in
// proportion to what they would give it, whether it sees them.
//
// Unbiased for what a ray to every VPL would give, which it becomes as rays become as many. Noise
// falls with rays^-.8 or so: VPLs are in order (pass/vpl_order.h). Cost: that of the gather, and
// per pixel as many rays.
// Madow 1949 (systematic sampling); Walter, Arbree, Bala, Greenberg 2006 (few of many lights).

#ifndef BD_PASS_GATHER_CHOSEN_H
#define BD_PASS_GATHER_CHOSEN_H

#include "pass/gather.h"

// More would not fit beside one another in a slice; ask all VPLs then.
#define BD_RAYS_CHOSEN_MAX 16384u

struct bd_gather_chosen_inputs {
    const struct bd_gather_inputs *gather; // with visibility; its lists are not read
    const struct bd_vpl_list *list;        // of all lights, in order (pass/vpl_order.h); not empty
    uint32_t rays; // a pixel, at most BD_RAYS_CHOSEN_MAX
    uint64_t seed;
};

// With `noise`, and `noise_glossy` where receivers are glossy.
BD_MUST_CHECK
enum bd_err bd_gather_chosen_run(const struct bd_pass_context *context,
                                 const struct bd_gather_chosen_inputs *inputs,
                                 struct bd_indirect **out, struct bd_fault *fault);

#endif
