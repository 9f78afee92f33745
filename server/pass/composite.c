#include "pass/composite.h"

#include "pass/kernels.h"
#include "shared/bindings.h"

// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_PIXEL 20.0

// A run of the program: what it is compiled with, and bound to.
struct run {
    struct bd_program_source source;
    struct bd_bindings bindings;
};

// Where it is asked for, and there.
static void read(struct run *run, bool asked, const struct bd_tex *tex, const char *define,
                 uint32_t unit)
{
    if (!asked || !tex) return;
    bd_define(&run->source.defines, define, 1);
    run->bindings.textures[unit].tex = tex;
}

static bool has(uint32_t layers, uint32_t which)
{
    return layers >> which & 1;
}

static void read_indirect(struct run *run, uint32_t layers, const struct bd_indirect *light)
{
    const bool doubt = has(layers, BD_COMPOSITE_NOISE) || has(layers, BD_COMPOSITE_BLUR);
    const bool indirect =
        has(layers, BD_COMPOSITE_BEAUTY) || has(layers, BD_COMPOSITE_INDIRECT) || doubt;
    read(run, indirect, light->irradiance, "BD_INDIRECT", BD_UNIT_INDIRECT);
    read(run, indirect, light->glossy, "BD_GLOSSY", BD_UNIT_INDIRECT_GLOSSY);
    read(run, indirect, light->rough, "BD_ROUGH", BD_UNIT_INDIRECT_ROUGH);
    read(run, doubt, light->noise, "BD_INDIRECT_DOUBT", BD_UNIT_INDIRECT_DOUBT);
    read(run, doubt, light->noise_glossy, "BD_GLOSSY_DOUBT", BD_UNIT_GLOSSY_DOUBT);
    read(run, doubt, light->noise_rough, "BD_ROUGH_DOUBT", BD_UNIT_ROUGH_DOUBT);
}

static void read_light(struct run *run, uint32_t layers, const struct bd_composite_inputs *inputs)
{
    const struct bd_area_direct *area = inputs->area_light;
    const struct bd_indirect *glass = inputs->glass;
    const bool doubt = has(layers, BD_COMPOSITE_NOISE) || has(layers, BD_COMPOSITE_BLUR);
    const bool beauty = has(layers, BD_COMPOSITE_BEAUTY);
    const bool direct = beauty || has(layers, BD_COMPOSITE_DIRECT);
    const bool indirect = beauty || has(layers, BD_COMPOSITE_INDIRECT);
    const bool emission = beauty || has(layers, BD_COMPOSITE_EMISSION);
    read(run, direct, inputs->direct, "BD_DIRECT", BD_UNIT_DIRECT);
    read(run, emission, inputs->gbuffer->emission, "BD_EMISSION", BD_UNIT_GBUFFER_EMISSION);
    if (area) read(run, direct || emission, area->radiance, "BD_AREA_LIGHT", BD_UNIT_AREA_LIGHT);
    if (area) read(run, doubt, area->doubt, "BD_AREA_DOUBT", BD_UNIT_AREA_DOUBT);
    if (inputs->indirect) read_indirect(run, layers, inputs->indirect);
    if (glass) read(run, indirect, glass->glossy, "BD_GLASS", BD_UNIT_GLASS);
    if (glass) read(run, doubt, glass->noise_glossy, "BD_GLASS_DOUBT", BD_UNIT_GLASS_DOUBT);
    if (inputs->filtered) bd_define(&run->source.defines, "BD_FILTERED", 1);
    if (inputs->whole) bd_define(&run->source.defines, "BD_WHOLE", 1);
    if (inputs->lambert) bd_define(&run->source.defines, "BD_LAMBERT", 1);
}

// Over all rows, in slices. `args` but for those.
static enum bd_err run_rows(const struct bd_pass_context *context,
                            const struct bd_program_source *source, const struct bd_view *view,
                            struct bd_bindings *bindings, struct bd_composite_args *args,
                            struct bd_err_detail *detail)
{
    struct bd_program *program;
    enum bd_err err = bd_program_get(context->gpu, source, &program, detail);
    if (err) return err;
    bindings->uniforms[BD_UNIFORM_VIEW].bytes = view;
    bindings->uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof *view;
    bindings->uniforms[BD_UNIFORM_ARGS].bytes = args;
    bindings->uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof *args;
    uint32_t group[3];
    bd_program_group_size(program, group);
    const uint32_t width = view->size_px.x, height = view->size_px.y;
    bd_slicer_work(context->slicer, "composite");
    for (uint32_t row = 0; !err && row < height;) {
        uint32_t rows = bd_slicer_rows(context->slicer, UNITS_PER_PIXEL * width, height - row);
        args->first_row = row;
        args->row_count = rows;
        bd_gpu_dispatch(context->gpu, program, bindings, (width + group[0] - 1) / group[0],
                        (rows + group[1] - 1) / group[1], 1);
        err = bd_slicer_checkpoint(context->slicer, UNITS_PER_PIXEL * width * rows);
        row += rows;
    }
    return err;
}

static enum bd_err write_layers(const struct bd_pass_context *context,
                                const struct bd_composite_inputs *inputs, uint32_t mask,
                                struct bd_tex *const layers[BD_COMPOSITE_LAYERS],
                                struct bd_err_detail *detail)
{
    const struct bd_render_space *space = &inputs->scene->space;
    const struct bd_view view = bd_viewpoint_uniform(inputs->viewpoint, space);
    struct bd_composite_args args = {
        .sub_frame_weight = 1,
        .unit_cd_m2 = (float)space->unit_cd_m2,
        .render_unit_m = (float)(1 / space->render_per_m),
        .noise_sign = inputs->halves_exchanged ? -1 : 1,
        .is_first_sub_frame = inputs->first,
        .is_only_sub_frame = inputs->only,
    };
    struct run run = {.source.compute = "pass/composite/composite.comp"};
    uint32_t written = 0;
    for (uint32_t l = 0; l < BD_COMPOSITE_LAYERS; l++) {
        if (!has(mask, l) || !layers[l]) continue;
        bd_bind_image(&run.bindings, BD_COMPOSITE_IMAGE(l), layers[l], true, true);
        written |= 1u << l;
    }
    if (!written) return BD_ERR_OK;
    bd_define(&run.source.defines, "BD_LAYERS", (int32_t)written);
    bd_gbuffer_bind(inputs->gbuffer, &run.bindings);
    if (!(written & BD_COMPOSITE_SURFACES)) read_light(&run, written, inputs);
    return run_rows(context, &run.source, &view, &run.bindings, &args, detail);
}

enum bd_err bd_composite_run(const struct bd_pass_context *context,
                             const struct bd_composite_inputs *inputs,
                             struct bd_tex *const layers[BD_COMPOSITE_LAYERS],
                             struct bd_err_detail *detail)
{
    enum bd_err err =
        write_layers(context, inputs, ~(uint32_t)BD_COMPOSITE_SURFACES, layers, detail);
    return err ? err : write_layers(context, inputs, BD_COMPOSITE_SURFACES, layers, detail);
}

enum bd_err bd_composite_finish(const struct bd_pass_context *context,
                                const struct bd_composite_sums *inputs, uint32_t which,
                                struct bd_tex *layer, struct bd_err_detail *detail)
{
    const struct bd_program_source source = {.compute = "pass/composite/finish.comp"};
    const struct bd_view view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space);
    struct bd_composite_args args = {.sub_frame_weight = 1.0f / (float)inputs->count,
                                     .layer = which};
    struct bd_bindings bindings = {0};
    bd_bind_image(&bindings, 0, layer, false, true);
    bd_bind_image(&bindings, 1, inputs->sums, true, false);
    return run_rows(context, &source, &view, &bindings, &args, detail);
}
