// Radius-limited splats: each VPL adds its irradiance to the pixels around it where the bound on it
// is above a given one, by a rectangle over them and additive blending (Dachsbacher and Stamminger
// 2006; algorithms.md A0.7 N3). What the gather sums at a pixel is summed here in the same order, a
// term at a time.
//
// Without a bound: the gather's light to rounding. With one: less light, at every pixel, by up to
// the bound a VPL; the last quarter of a splat's cross-section fades to nothing. A splat covers the
// whole ball within its bound, though a VPL lights one side of its plane alone.

#ifndef BD_PASS_SPLAT_VPLS_H
#define BD_PASS_SPLAT_VPLS_H

#include "pass/splat_bound.h"

// `out`->irradiance.a counts the splats of a pixel, `fragment_count` those of all pixels.
BD_MUST_CHECK
enum bd_err bd_splat_vpls_run(const struct bd_pass_context *context,
                              const struct bd_gather_inputs *inputs,
                              const struct bd_splat_bound *bound, struct bd_indirect **out,
                              struct bd_err_detail *detail);

#endif
