// Lists of VPLs where the processor's loops read them. Private to pass/.

#ifndef BD_PASS_NATIVE_LISTS_H
#define BD_PASS_NATIVE_LISTS_H

#include "pass/native/native.h"
#include "pass/receivers.h"
#include "pass/vpl_grid.h"

// Borrows whole lists; to be returned even after a failure.
BD_MUST_CHECK
enum bd_err bd_native_lists_borrow(struct bd_gpu *gpu, const struct bd_vpl_list *const *lists,
                                   uint32_t count, struct bd_native_vpls **out,
                                   struct bd_err_detail *detail);
void bd_native_lists_return(struct bd_gpu *gpu, const struct bd_vpl_list *const *lists,
                            uint32_t count, struct bd_native_vpls **borrowed);

// The list in blocks, of as many groups; to be freed. NULL: no memory.
struct bd_native_block *bd_native_blocks_make(const struct bd_native_vpls *list, size_t count);

static inline struct bd_native_wishes bd_native_wishes_of(const struct bd_receivers_inputs *inputs)
{
    return (struct bd_native_wishes){inputs->askers.near_patches, inputs->askers.vector,
                                     inputs->spread};
}

#endif
