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

// In the slicer's unit, an evaluation of a VPL: three walks over the texels.
#define UNITS_PER_TEXEL 12.0
// Blocks with a longer side get a work group each. At 32 a member would have one texel.
#define SOLITARY_BLOCK_SIDE_MAX 32u

struct vpl_grid {
    const struct bd_pass_context *context;
    const struct bd_vpl_grid_inputs *inputs;
    const struct bd_program *program;
    bool group_per_vpl;
    const struct bd_vpl_list *list;
};

static void dispatch(const struct vpl_grid *g, uint32_t face, uint32_t row, uint32_t rows)
{
    const struct bd_vpl_grid_inputs *inputs = g->inputs;
    const struct bd_vpl_grid_args args = {
        .grid = {inputs->grid_side, (uint32_t)inputs->kernel, inputs->rsm->weight_layer_count == 1,
                 0},
        .slice = {row, rows, face, 0},
        .limits = {(float)inputs->near_field, 0, 0, 0},
    };
    const struct bd_light_uniform light =
        bd_light_setup_uniform(inputs->light, inputs->space, inputs->rsm->side_px);
    struct bd_bindings bindings = {0};
    bind_rsm(&bindings, inputs->rsm);
    bindings.storage[BD_STORAGE_VPLS].buf = g->list->vpls;
    bindings.storage[BD_STORAGE_VPLS].write = true;
    bindings.storage[BD_STORAGE_VPL_QUADS].buf = g->list->quads;
    bindings.storage[BD_STORAGE_VPL_QUADS].write = true;
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
    bindings.uniforms[BD_UNIFORM_LIGHT].bytes = &light;
    bindings.uniforms[BD_UNIFORM_LIGHT].size_bytes = sizeof light;
    uint32_t group[3] = {1, 1, 1};
    if (!g->group_per_vpl) bd_program_group_size(g->program, group);
    bd_gpu_dispatch(g->context->gpu, g->program, &bindings,
                    (inputs->grid_side + group[0] - 1) / group[0], (rows + group[1] - 1) / group[1],
                    1);
}

static enum bd_err fill_list(const struct vpl_grid *g)
{
    const uint32_t grid_side = g->inputs->grid_side, side_px = g->inputs->rsm->side_px;
    double units_per_row = UNITS_PER_TEXEL * side_px * side_px / grid_side;
    for (uint32_t face = 0; face < g->inputs->rsm->face_count; face++) {
        for (uint32_t row = 0; row < grid_side;) {
            uint32_t rows = bd_slicer_rows(g->context->slicer, units_per_row, grid_side - row);
            dispatch(g, face, row, rows);
            enum bd_err err = bd_slicer_checkpoint(g->context->slicer, 0);
            if (err) return err;
            row += rows;
        }
    }
    return BD_ERR_OK;
}

static enum bd_err get_program(struct vpl_grid *g, struct bd_fault *fault)
{
    struct bd_program_source source = {.compute = "pass/vpl_grid/vpl_grid.comp"};
    if (g->group_per_vpl) bd_define(&source.defines, "BD_GROUP_PER_VPL", 1);
    struct bd_program *program = NULL;
    enum bd_err err = bd_program_get(g->context->gpu, &source, &program, fault);
    g->program = program;
    return err;
}

enum bd_err bd_vpl_grid_run(const struct bd_pass_context *context,
                            const struct bd_vpl_grid_inputs *inputs, struct bd_vpl_list **out,
                            struct bd_fault *fault)
{
    BD_ASSERT_CMP(inputs->grid_side, <=, inputs->rsm->side_px);
    struct bd_vpl_list *list = calloc(1, sizeof *list);
    BD_ASSERT(list);
    struct vpl_grid g = {
        .context = context,
        .inputs = inputs,
        .group_per_vpl = inputs->rsm->side_px > SOLITARY_BLOCK_SIDE_MAX * inputs->grid_side,
        .list = list,
    };
    uint32_t count = inputs->grid_side * inputs->grid_side * inputs->rsm->face_count;
    enum bd_err err = get_program(&g, fault);
    if (!err) err = create_list(context->gpu, count, list, fault);
    if (!err) err = fill_list(&g);
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
