#include "pass/vpl_grid.h"

#include "base/assert.h"
#include "pass/vpl_block.h"
#include "shared/bindings.h"
#include "shared/vpl_grid.h"

struct vpl_grid {
    const struct bd_pass_context *context;
    const struct bd_vpl_grid_inputs *inputs;
    const struct bd_program *program;
    bool group_per_vpl;
    struct bd_vpl_list *list;
};

static void dispatch(const struct vpl_grid *g, uint32_t face, uint32_t row, uint32_t rows)
{
    const struct bd_vpl_grid_inputs *inputs = g->inputs;
    const struct bd_vpl_grid_args args = {
        .block = bd_vpl_block_args(inputs->rsm, face, inputs->kernel, inputs->near_field),
        .grid_side = inputs->grid_side,
        .first_row = row,
        .row_count = rows,
    };
    const struct bd_light_uniform light =
        bd_light_setup_uniform(inputs->light, inputs->space, inputs->rsm->side_px);
    struct bd_bindings bindings = {0};
    bd_vpl_block_bind(inputs->rsm, g->list, &bindings);
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
    bd_slicer_work(g->context->slicer, g->group_per_vpl ? "vpl_grid shared" : "vpl_grid");
    double units_per_row = BD_VPL_BLOCK_UNITS_PER_TEXEL * side_px * side_px / grid_side;
    for (uint32_t face = 0; face < g->inputs->rsm->face_count; face++) {
        for (uint32_t row = 0; row < grid_side;) {
            uint32_t rows = bd_slicer_rows(g->context->slicer, units_per_row, grid_side - row);
            dispatch(g, face, row, rows);
            enum bd_err err = bd_slicer_checkpoint(g->context->slicer, units_per_row * rows);
            if (err) return err;
            row += rows;
        }
    }
    return BD_ERR_OK;
}

static enum bd_err get_program(struct vpl_grid *g, struct bd_err_detail *detail)
{
    struct bd_program_source source = {.compute = "pass/vpl_grid/vpl_grid.comp"};
    if (g->group_per_vpl) bd_define(&source.defines, "BD_GROUP_PER_VPL", 1);
    struct bd_program *program = NULL;
    enum bd_err err = bd_program_get(g->context->gpu, &source, &program, detail);
    g->program = program;
    return err;
}

enum bd_err bd_vpl_grid_run(const struct bd_pass_context *context,
                            const struct bd_vpl_grid_inputs *inputs, struct bd_vpl_list **out,
                            struct bd_err_detail *detail)
{
    BD_ASSERT_CMP(inputs->grid_side, <=, inputs->rsm->side_px);
    struct vpl_grid g = {
        .context = context,
        .inputs = inputs,
        .group_per_vpl = inputs->rsm->side_px > BD_VPL_BLOCK_SOLITARY_SIDE_MAX * inputs->grid_side,
    };
    uint32_t count = inputs->grid_side * inputs->grid_side * inputs->rsm->face_count;
    enum bd_err err = bd_vpl_list_create(context->gpu, count, &g.list, detail);
    if (!err) err = get_program(&g, detail);
    if (!err) err = fill_list(&g);
    if (err) {
        bd_vpl_list_destroy(context->gpu, &g.list);
        return err;
    }
    *out = g.list;
    return BD_ERR_OK;
}
