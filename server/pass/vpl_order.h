// All VPLs of a frame in an order in which neighbours are alike: by the face of their normal, then
// along a Morton curve through their positions. Systematic sampling over such a list takes its
// samples from all parts of the light. VPLs that send nothing are left out. A long list has groups
// of neighbours, too.
//
// A *soft* list has one area for all, so large that a receiver among its VPLs sees an even light
// and not single ones: what is lost near them is known from the distance alone (pass/far.h).
//
// Morton 1966.

#ifndef BD_PASS_VPL_ORDER_H
#define BD_PASS_VPL_ORDER_H

#include "pass/vpl_grid.h"

// `radius` is the render space's. `*out` is the caller's, to be destroyed as any list.
BD_MUST_CHECK
enum bd_err bd_vpl_order_run(const struct bd_pass_context *context,
                             const struct bd_vpl_list *const *lists, uint32_t list_count,
                             float radius, bool soft, struct bd_vpl_list **out,
                             struct bd_err_detail *detail);

#endif
