// Light of VPLs at receivers by the processor's loops (pass/native), where the context has one: the
// same sums as pass/gather, pass/gather_fragments and pass/gather_tree make on the device.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_GATHER_NATIVE_H
#define BD_PASS_GATHER_NATIVE_H

#include "pass/gather_tree.h"
#include "pass/receivers.h"

struct bd_gather_native_inputs {
    struct bd_receivers_inputs receivers;   // with `pass`, without `light`
    const struct bd_vpl_list *const *lists; // one a light, in the order that they are summed in
    uint32_t list_count;
    const struct bd_visibility_inputs *visibility; // NULL: nothing hides any of it
};

// Whether the processor may: what a device is asked about visibility, it keeps for itself.
bool bd_gather_may_be_native(const struct bd_pass_context *context,
                             const struct bd_visibility_inputs *visibility);
// Adds the rays that it traced to `rays`.
BD_MUST_CHECK
enum bd_err bd_gather_native_run(const struct bd_pass_context *context,
                                 const struct bd_gather_native_inputs *inputs,
                                 struct bd_ray_counts *rays, struct bd_err_detail *detail);

// Of a few of a list, chosen as pass/choose does, that are seen. No lobes.
struct bd_gather_chosen_native_inputs {
    struct bd_receivers_inputs receivers; // with `pass`, without `light` and `starts`
    const struct bd_vpl_list *list;       // of all lights, in order (pass/vpl_order.h); not empty
    uint32_t rays;                        // a receiver, at most BD_RAYS_CHOSEN_MAX
    const struct bd_visibility_inputs *visibility;
    f3 *of_points; // where points are the receivers, within whatever pass: adds to what they got
};

BD_MUST_CHECK
enum bd_err bd_gather_chosen_native_run(const struct bd_pass_context *context,
                                        const struct bd_gather_chosen_native_inputs *inputs,
                                        struct bd_ray_counts *rays, struct bd_err_detail *detail);

// Of cuts of trees; not by the printed criterion.
BD_MUST_CHECK
enum bd_err bd_gather_tree_native_run(const struct bd_pass_context *context,
                                      const struct bd_receivers_inputs *receivers,
                                      const struct bd_gather_tree_inputs *inputs,
                                      struct bd_err_detail *detail);

#endif
