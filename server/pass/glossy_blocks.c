#include "pass/glossy_blocks.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/glossy_blocks.h"

// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_BLOCK 40.0
#define NO_LIMIT        1e9

struct work {
    const struct bd_pass_context *context;
    const struct bd_glossy_blocks_inputs *inputs;
    struct bd_view view;
    struct bd_tex *least, *most; // RGBA32UI stacks
    struct bd_discontinuity *out;
};

static enum bd_err create_stack(struct bd_gpu *gpu, const char *name, enum bd_format format,
                                const struct bd_multires_layout *layout, struct bd_tex **out,
                                struct bd_err_detail *detail)
{
    struct bd_tex_desc desc = {.name = name, .format = format};
    bd_multires_stack_size(layout, &desc.width_px, &desc.height_px);
    return bd_tex_create(gpu, &desc, out, detail);
}

static enum bd_err create_out(struct bd_gpu *gpu, const struct bd_multires_layout *layout,
                              struct bd_discontinuity **out, struct bd_err_detail *detail)
{
    struct bd_discontinuity *made = calloc(1, sizeof *made);
    BD_ASSERT(made);
    made->layout = *layout;
    made->glossy = true;
    enum bd_err err =
        create_stack(gpu, "glossy blocks", BD_FORMAT_R32UI, layout, &made->flags, detail);
    if (err) bd_discontinuity_destroy(gpu, &made);
    *out = made;
    return err;
}

static struct bd_bindings bind(const struct work *w, const struct bd_glossy_blocks_args *args)
{
    struct bd_bindings bindings = {
        .textures[BD_UNIT_BLOCK_FLAGS] = {.tex = w->inputs->discontinuity->flags},
        .uniforms[BD_UNIFORM_VIEW] = {&w->view, sizeof w->view},
        .uniforms[BD_UNIFORM_MULTIRES] = {&w->out->layout, sizeof w->out->layout},
        .uniforms[BD_UNIFORM_ARGS] = {args, sizeof *args},
    };
    bd_gbuffer_bind(w->inputs->gbuffer, &bindings);
    bd_bind_image(&bindings, BD_IMAGE_GLOSSY_FLAGS, w->out->flags, true, true);
    bd_bind_image(&bindings, BD_IMAGE_SURFACE_LEAST, w->least, true, true);
    bd_bind_image(&bindings, BD_IMAGE_SURFACE_MOST, w->most, true, true);
    return bindings;
}

static enum bd_err run_level(const struct work *w, uint32_t level, struct bd_err_detail *detail)
{
    struct bd_program_source source = {.compute = "pass/glossy_blocks/glossy_blocks.comp"};
    if (level == 1) bd_define(&source.defines, "BD_PIXELS", 1);
    struct bd_program *program;
    enum bd_err err = bd_program_get(w->context->gpu, &source, &program, detail);
    const struct bd_multires_level size = w->out->layout.levels[level];
    const double units_per_row = UNITS_PER_BLOCK * size.columns;
    bd_slicer_work(w->context->slicer, "glossy_blocks");
    for (uint32_t row = 0; !err && row < size.rows;) {
        uint32_t rows = bd_slicer_rows(w->context->slicer, units_per_row, size.rows - row);
        const struct bd_glossy_blocks_args args = {
            .level = level,
            .first_row = row,
            .row_count = rows,
            .normal_threshold = (float)fmin(w->inputs->normal_threshold, NO_LIMIT),
            .material_threshold = (float)fmin(w->inputs->material_threshold, NO_LIMIT),
        };
        struct bd_bindings bindings = bind(w, &args);
        bd_gpu_dispatch(w->context->gpu, program, &bindings, (size.columns + 7) / 8, (rows + 7) / 8,
                        1);
        row += rows;
        if (row < size.rows) err = bd_slicer_checkpoint(w->context->slicer, units_per_row * rows);
    }
    return err;
}

enum bd_err bd_glossy_blocks_run(const struct bd_pass_context *context,
                                 const struct bd_glossy_blocks_inputs *inputs,
                                 struct bd_discontinuity **out, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = context->gpu;
    struct work w = {
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, inputs->space),
    };
    const struct bd_multires_layout *layout = &inputs->discontinuity->layout;
    enum bd_err err = create_out(gpu, layout, &w.out, detail);
    if (!err)
        err = create_stack(gpu, "surfaces, least", BD_FORMAT_RGBA32UI, layout, &w.least, detail);
    if (!err)
        err = create_stack(gpu, "surfaces, most", BD_FORMAT_RGBA32UI, layout, &w.most, detail);
    for (uint32_t level = 1; !err && level < layout->level_count; level++)
        err = run_level(&w, level, detail);
    bd_tex_destroy(gpu, &w.least);
    bd_tex_destroy(gpu, &w.most);
    if (err) {
        bd_discontinuity_destroy(gpu, &w.out);
        return err;
    }
    *out = w.out;
    return BD_ERR_OK;
}

enum bd_err bd_glossy_pixels(struct bd_gpu *gpu, const struct bd_viewpoint *viewpoint,
                             struct bd_discontinuity **out, struct bd_err_detail *detail)
{
    const uint32_t width = viewpoint->width_px, height = viewpoint->height_px;
    const struct bd_multires_layout layout =
        bd_multires_layout_of(width, height, width > height ? width : height);
    return create_out(gpu, &layout, out, detail);
}
