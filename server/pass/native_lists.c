#include "pass/native_lists.h"

#include <stdlib.h>

#include "base/assert.h"
#include "kernel/all_channels.h"
#include "shared/vpl.h"

static enum bd_err borrow(struct bd_gpu *gpu, const struct bd_vpl_list *list,
                          struct bd_native_vpls *out, struct bd_err_detail *detail)
{
    void *vpls = NULL, *quads = NULL;
    enum bd_err err = bd_buf_borrow(gpu, list->vpls, BD_BORROW_TO_READ, &vpls, detail);
    if (!err) err = bd_buf_borrow(gpu, list->quads, BD_BORROW_TO_READ, &quads, detail);
    *out = (struct bd_native_vpls){vpls, quads, 0, list->count};
    return err;
}

enum bd_err bd_native_lists_borrow(struct bd_gpu *gpu, const struct bd_vpl_list *const *lists,
                                   uint32_t count, struct bd_native_vpls **out,
                                   struct bd_err_detail *detail)
{
    struct bd_native_vpls *borrowed = *out = calloc(count + 1, sizeof *borrowed);
    BD_ASSERT(borrowed);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < count; i++) err = borrow(gpu, lists[i], &borrowed[i], detail);
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

static void put_in_block(const struct bd_vec4 *vpl, struct bd_native_block *block, size_t k)
{
    block->x[k] = vpl->x;
    block->y[k] = vpl->y;
    block->z[k] = vpl->z;
    block->normal_x[k] = vpl[1].x;
    block->normal_y[k] = vpl[1].y;
    block->normal_z[k] = vpl[1].z;
    block->area[k] = vpl->w;
    block->near2[k] = vpl[1].w;
    block->strength[k] = all_channels(f3_of(vpl[2].x, vpl[2].y, vpl[2].z));
}

struct bd_native_block *bd_native_blocks_make(const struct bd_native_vpls *list, size_t count)
{
    struct bd_native_block *blocks = calloc(count, sizeof *blocks);
    for (size_t i = 0; blocks && i < list->end; i++)
        put_in_block(&list->vpls[i * BD_VPL_VEC4S], &blocks[i / BD_NATIVE_BLOCK],
                     i % BD_NATIVE_BLOCK);
    return blocks;
}
