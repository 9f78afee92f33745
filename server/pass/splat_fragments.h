// Multiresolution splatting (Nichols and Wyman 2010, 3.4; algorithms.md A1): for each VPL every
// fragment of the picture is drawn as a point, and blended additively into the multiresolution
// image.
//
// The same fragments with the same light as the gather's, to rounding; a fragment's receiver is
// made anew for every VPL, and its sum is read and written again. It is what gathering is measured
// against.

#ifndef BD_PASS_SPLAT_FRAGMENTS_H
#define BD_PASS_SPLAT_FRAGMENTS_H

#include "pass/gather_fragments.h"

// `inputs->visit` is of no account.
BD_MUST_CHECK
enum bd_err bd_splat_fragments_run(const struct bd_pass_context *context,
                                   const struct bd_gather_fragments_inputs *inputs,
                                   struct bd_multires_light **out, struct bd_err_detail *detail);

#endif
