// Gather at fragments with a few rays: each weighs all VPLs, and asks after some of them, chosen in
// proportion to what they would give it (pass/choose.h), whether it sees them. A fragment's light
// is what its surface sees at one point, and is interpolated as any other.

#ifndef BD_PASS_GATHER_CHOSEN_FRAGMENTS_H
#define BD_PASS_GATHER_CHOSEN_FRAGMENTS_H

#include "pass/gather_fragments.h"

struct bd_gather_chosen_fragments_inputs {
    const struct bd_gather_fragments_inputs *gather; // with visibility; its lists are not read
    const struct bd_vpl_list *list; // of all lights, in order (pass/vpl_order.h); not empty
    const struct bd_choice *choice; // or this, instead of the list
    uint32_t rays;                  // a fragment, at most BD_RAYS_CHOSEN_MAX
    uint64_t seed;
    bool noise; // is asked for, of light that is not added to
};

BD_MUST_CHECK
enum bd_err bd_gather_chosen_fragments_run(const struct bd_pass_context *context,
                                           const struct bd_gather_chosen_fragments_inputs *inputs,
                                           struct bd_multires_light **out,
                                           struct bd_err_detail *detail);

#endif
