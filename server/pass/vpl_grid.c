#include "pass/vpl_grid.h"

#include <stdlib.h>

#include "base/assert.h"
#include "shared/bindings.h"
#include "shared/types.h"
#include "shared/vpl.h"
#include "shared/vpl_grid.h"

_Static_assert(BD_KERNEL_PATCH == BD_VPL_KERNEL_PATCH, "C and GLSL agree");
_Static_assert(BD_KERNEL_DISK == BD_VPL_KERNEL_DISK, "C and GLSL agree");
_Static_assert(BD_KERNEL_POINT == BD_VPL_KERNEL_POINT, "C and GLSL agree");

static enum bd_err create_list(struct bd_gpu *gpu, uint32_t count, struct bd_vpl_list *list,
                               struct bd_fault *fault)
{
    list->count = count;
    enum bd_err err =
        bd_buf_create(gpu, "vpls", (size_t)count * BD_VPL_VEC4S * sizeof(struct bd_vec4), NULL,
                      &list->vpls, fault);
    if (err) return err;
    return bd_buf_create(gpu, "vpl quads",
                         (size_t)count * BD_VPL_QUAD_VEC4S * sizeof(struct bd_vec4), NULL,
                         &list->quads, fault);
}

static void bind_rsm(struct bd_bindings *bindings, const struct bd_rsm *rsm)
{
    bindings->textures[BD_UNIT_RSM_POSITION].tex = rsm->position;
    bindings->textures[BD_UNIT_RSM_NORMAL].tex = rsm->normals;
    bindings->textures[BD_UNIT_RSM_ALBEDO].tex = rsm->albedo;
    bindings->textures[BD_UNIT_RSM_WEIGHT].tex = rsm->weight;
}

static void dispatch(struct bd_gpu *gpu, const struct bd_program *program,
                     const struct bd_vpl_grid_inputs *inputs, const struct bd_vpl_list *list)
{
    const struct bd_vpl_grid_args args = {
        .grid = {inputs->grid_side, (uint32_t)inputs->kernel,
                 inputs->rsm->weight_layer_count == 1, 0},
        .limits = {(float)inputs->near_field, 0, 0, 0},
    };
    const struct bd_light_uniform light =
        bd_light_setup_uniform(inputs->light, inputs->space, inputs->rsm->side_px);
    struct bd_bindings bindings = {0};
    bind_rsm(&bindings, inputs->rsm);
    bindings.storage[BD_STORAGE_VPLS].buf = list->vpls;
    bindings.storage[BD_STORAGE_VPLS].write = true;
    bindings.storage[BD_STORAGE_VPL_QUADS].buf = list->quads;
    bindings.storage[BD_STORAGE_VPL_QUADS].write = true;
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
    bindings.uniforms[BD_UNIFORM_LIGHT].bytes = &light;
    bindings.uniforms[BD_UNIFORM_LIGHT].size_bytes = sizeof light;
    uint32_t group[3];
    bd_program_group_size(program, group);
    bd_gpu_dispatch(gpu, program, &bindings, (inputs->grid_side + group[0] - 1) / group[0],
                    (inputs->grid_side + group[1] - 1) / group[1], inputs->rsm->face_count);
}

enum bd_err bd_vpl_grid_run(const struct bd_pass_context *context,
                            const struct bd_vpl_grid_inputs *inputs, struct bd_vpl_list **out,
                            struct bd_fault *fault)
{
    BD_ASSERT_CMP(inputs->grid_side, <=, inputs->rsm->side_px);
    struct bd_vpl_list *list = calloc(1, sizeof *list);
    BD_ASSERT(list);
    const struct bd_program_source source = {.compute = "pass/vpl_grid/vpl_grid.comp"};
    uint32_t count = inputs->grid_side * inputs->grid_side * inputs->rsm->face_count;
    struct bd_program *program;
    enum bd_err err = bd_program_get(context->gpu, &source, &program, fault);
    if (!err) err = create_list(context->gpu, count, list, fault);
    if (!err) {
        dispatch(context->gpu, program, inputs, list);
        err = bd_slicer_checkpoint(context->slicer, 0);
    }
    if (err) {
        bd_vpl_list_destroy(context->gpu, &list);
        return err;
    }
    *out = list;
    return BD_ERR_OK;
}

void bd_vpl_list_destroy(struct bd_gpu *gpu, struct bd_vpl_list **list)
{
    if (!*list) return;
    bd_buf_destroy(gpu, &(*list)->vpls);
    bd_buf_destroy(gpu, &(*list)->quads);
    free(*list);
    *list = NULL;
}

uint64_t bd_vpl_list_bytes(const struct bd_vpl_list *list)
{
    return bd_buf_size_bytes(list->vpls) + bd_buf_size_bytes(list->quads);
}
