// Lists of VPLs and what is shared by whoever makes them from blocks of a light's map.

#include <stdlib.h>

#include "base/assert.h"
#include "pass/vpl_block.h"
#include "shared/bindings.h"
#include "shared/types.h"
#include "shared/vpl.h"

_Static_assert(BD_KERNEL_PATCH == BD_VPL_KERNEL_PATCH, "C and GLSL agree");
_Static_assert(BD_KERNEL_DISK == BD_VPL_KERNEL_DISK, "C and GLSL agree");
_Static_assert(BD_KERNEL_POINT == BD_VPL_KERNEL_POINT, "C and GLSL agree");

enum bd_err bd_vpl_list_create(struct bd_gpu *gpu, uint32_t count, struct bd_vpl_list **out,
                               struct bd_err_detail *detail)
{
    struct bd_vpl_list *list = *out = calloc(1, sizeof **out);
    BD_ASSERT(list);
    list->count = count;
    const size_t vec4s = (count > 0 ? count : 1) * sizeof(struct bd_vec4);
    enum bd_err err = bd_buf_create(gpu, "vpls", BD_VPL_VEC4S * vec4s, NULL, &list->vpls, detail);
    if (!err)
        err =
            bd_buf_create(gpu, "vpl quads", BD_VPL_QUAD_VEC4S * vec4s, NULL, &list->quads, detail);
    if (err) bd_vpl_list_destroy(gpu, out);
    return err;
}

void bd_vpl_list_destroy(struct bd_gpu *gpu, struct bd_vpl_list **list)
{
    if (!*list) return;
    bd_buf_destroy(gpu, &(*list)->vpls);
    bd_buf_destroy(gpu, &(*list)->quads);
    bd_buf_destroy(gpu, &(*list)->groups);
    free(*list);
    *list = NULL;
}

uint64_t bd_vpl_list_bytes(const struct bd_vpl_list *list)
{
    const uint64_t of_groups = list->groups ? bd_buf_size_bytes(list->groups) : 0;
    return bd_buf_size_bytes(list->vpls) + bd_buf_size_bytes(list->quads) + of_groups;
}

struct bd_vpl_block_args bd_vpl_block_args(const struct bd_rsm *rsm, uint32_t face,
                                           enum bd_vpl_kernel kernel, double near_field)
{
    return (struct bd_vpl_block_args){
        .kernel = (uint32_t)kernel,
        .has_one_weight_layer = rsm->weights->layer_count == 1,
        .face = face,
        .near_field = (float)near_field,
    };
}

void bd_vpl_block_bind(const struct bd_rsm *rsm, const struct bd_vpl_list *list,
                       struct bd_bindings *bindings)
{
    bindings->textures[BD_UNIT_RSM_POSITION].tex = rsm->position;
    bindings->textures[BD_UNIT_RSM_NORMAL].tex = rsm->normals;
    bindings->textures[BD_UNIT_RSM_ALBEDO].tex = rsm->albedo;
    bindings->textures[BD_UNIT_RSM_WEIGHT].tex = rsm->weights->tex;
    bindings->storage[BD_STORAGE_VPLS].buf = list->vpls;
    bindings->storage[BD_STORAGE_VPLS].write = true;
    bindings->storage[BD_STORAGE_VPL_QUADS].buf = list->quads;
    bindings->storage[BD_STORAGE_VPL_QUADS].write = true;
}
