#include "pass/native_lists.h"

#include <stdlib.h>

#include "base/assert.h"

static enum bd_err borrow(struct bd_gpu *gpu, const struct bd_vpl_list *list,
                          struct bd_native_vpls *out, struct bd_fault *fault)
{
    void *vpls = NULL, *quads = NULL;
    enum bd_err err = bd_buf_borrow(gpu, list->vpls, BD_BORROW_TO_READ, &vpls, fault);
    if (!err) err = bd_buf_borrow(gpu, list->quads, BD_BORROW_TO_READ, &quads, fault);
    *out = (struct bd_native_vpls){vpls, quads, 0, list->count};
    return err;
}

enum bd_err bd_native_lists_borrow(struct bd_gpu *gpu, const struct bd_vpl_list *const *lists,
                                   uint32_t count, struct bd_native_vpls **out,
                                   struct bd_fault *fault)
{
    struct bd_native_vpls *borrowed = *out = calloc(count + 1, sizeof *borrowed);
    BD_ASSERT(borrowed);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < count; i++) err = borrow(gpu, lists[i], &borrowed[i], fault);
    return err;
}

void bd_native_lists_return(struct bd_gpu *gpu, const struct bd_vpl_list *const *lists,
                            uint32_t count, struct bd_native_vpls **borrowed)
{
    for (uint32_t i = 0; *borrowed && i < count; i++) {
        void *vpls = (void *)(*borrowed)[i].vpls, *quads = (void *)(*borrowed)[i].quads;
        bd_buf_return(gpu, lists[i]->vpls, BD_BORROW_TO_READ, &vpls);
        bd_buf_return(gpu, lists[i]->quads, BD_BORROW_TO_READ, &quads);
    }
    free(*borrowed);
    *borrowed = NULL;
}
