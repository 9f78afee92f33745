// All VPLs of a frame in an order in which neighbours are alike: by the face of their normal, then
// along a Morton curve through their positions. Systematic sampling over such a list takes its
// samples from all parts of the light. VPLs that send nothing are left out. A long list has groups
// of neighbours, too.
//
// A *soft* list has one area for all, so large that a receiver among its VPLs sees an even light
// and not single ones: what is lost near them is known from the distance alone (pass/far.h). A
// *clamped* one has points of which cos cos / r^2 is bounded (algorithms.md A3: G_b).
//
// Morton 1966.

#ifndef BD_PASS_VPL_ORDER_H
#define BD_PASS_VPL_ORDER_H

#include "pass/vpl_grid.h"

enum bd_vpl_softness { BD_VPLS_AS_THEY_ARE, BD_VPLS_SOFT, BD_VPLS_CLAMPED };

// Beyond this nothing is clamped, per render unit squared: VPLs at one place give no more. Below
// the other all is, whose reach is a million render units.
#define BD_VPL_CLAMP_MAX 1e12
#define BD_VPL_CLAMP_MIN 1e-12

struct bd_vpl_order_how {
    float radius; // of the render space
    enum bd_vpl_softness softness;
    // Of BD_VPLS_CLAMPED: the bound, per render unit squared; 0: by how far VPLs are apart.
    float clamp;
};

// `*out` is the caller's, to be destroyed as any list.
BD_MUST_CHECK
enum bd_err bd_vpl_order_run(const struct bd_pass_context *context,
                             const struct bd_vpl_list *const *lists, uint32_t list_count,
                             const struct bd_vpl_order_how *how, struct bd_vpl_list **out,
                             struct bd_err_detail *detail);

#endif
