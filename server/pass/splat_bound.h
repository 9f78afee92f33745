// The bound of radius-limited splats (Dachsbacher and Stamminger 2006; algorithms.md A0.7 N3): a
// VPL of outgoing flux P lights the pixels within sqrt(P / (pi t)) of it alone, beyond which it
// gives less irradiance than t. Here t is found that makes all splats together as many fragments as
// are wanted, as Nichols, Shopf and Wyman 2009 have it for their Fig. 8.

#ifndef BD_PASS_SPLAT_BOUND_H
#define BD_PASS_SPLAT_BOUND_H

#include "pass/gather.h"

struct bd_splat_bound {
    float irradiance;        // t, in the frame's light unit; 0 = no bound
    uint64_t fragment_count; // of all splats
};

// The least bound, to 1e-5 of itself, whose splats are no more fragments than `share` of those of a
// splat over the whole picture for each VPL; at a share of 1 no bound. Fragments are what is
// rasterised, lit or not. Waits for the device.
BD_MUST_CHECK
enum bd_err bd_splat_bound_find(const struct bd_pass_context *context,
                                const struct bd_gather_inputs *inputs, double share,
                                struct bd_splat_bound *out, struct bd_err_detail *detail);

#endif
