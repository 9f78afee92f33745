#include "pass/composite.h"

#include "pass/kernels.h"
#include "shared/bindings.h"

// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_PIXEL 20.0

static struct bd_program_source source_of(const struct bd_composite_inputs *inputs, uint32_t which)
{
    struct bd_program_source source = {.compute = "pass/composite/composite.comp"};
    const struct bd_indirect *light = inputs->indirect;
    bool noise = which == BD_COMPOSITE_NOISE, blur = which == BD_COMPOSITE_BLUR;
    bool indirect = which == BD_COMPOSITE_BEAUTY || which == BD_COMPOSITE_INDIRECT;
    bool direct = which == BD_COMPOSITE_BEAUTY || which == BD_COMPOSITE_DIRECT;
    bool emission = which == BD_COMPOSITE_BEAUTY || which == BD_COMPOSITE_EMISSION;
    bd_define(&source.defines, "BD_LAYER", (int32_t)which);
    if (direct && inputs->direct) bd_define(&source.defines, "BD_DIRECT", 1);
    if ((direct || emission || noise || blur) && inputs->area_light)
        bd_define(&source.defines, "BD_AREA_LIGHT", 1);
    bool doubt = noise || (blur && inputs->filtered);
    if (light && (doubt ? light->noise != NULL : indirect))
        bd_define(&source.defines, "BD_INDIRECT", 1);
    if (light && (doubt ? light->noise_glossy != NULL : indirect && light->glossy))
        bd_define(&source.defines, "BD_GLOSSY", 1);
    if (light && (doubt ? light->noise_rough != NULL : indirect && light->rough))
        bd_define(&source.defines, "BD_ROUGH", 1);
    if (inputs->glass && (indirect || doubt)) bd_define(&source.defines, "BD_GLASS", 1);
    if (emission && inputs->gbuffer->emission) bd_define(&source.defines, "BD_EMISSION", 1);
    if (inputs->whole) bd_define(&source.defines, "BD_WHOLE", 1);
    if (inputs->lambert) bd_define(&source.defines, "BD_LAMBERT", 1);
    return source;
}

// The doubt of each light stands where the light does.
static void bind_inputs(const struct bd_composite_inputs *inputs, bool doubt,
                        struct bd_bindings *bindings)
{
    const struct bd_area_direct *area = inputs->area_light;
    const struct bd_indirect *indirect = inputs->indirect;
    bd_gbuffer_bind(inputs->gbuffer, bindings);
    bindings->textures[BD_UNIT_GBUFFER_EMISSION].tex = inputs->gbuffer->emission;
    bindings->textures[BD_UNIT_DIRECT].tex = inputs->direct;
    if (area) bindings->textures[BD_UNIT_AREA_LIGHT].tex = doubt ? area->doubt : area->radiance;
    if (inputs->glass)
        bindings->textures[BD_UNIT_GLASS].tex =
            doubt ? inputs->glass->noise_glossy : inputs->glass->glossy;
    if (!indirect) return;
    bindings->textures[BD_UNIT_INDIRECT].tex = doubt ? indirect->noise : indirect->irradiance;
    bindings->textures[BD_UNIT_INDIRECT_GLOSSY].tex =
        doubt ? indirect->noise_glossy : indirect->glossy;
    bindings->textures[BD_UNIT_INDIRECT_ROUGH].tex =
        doubt ? indirect->noise_rough : indirect->rough;
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

enum bd_err bd_composite_run(const struct bd_pass_context *context,
                             const struct bd_composite_inputs *inputs, uint32_t which,
                             struct bd_tex *layer, struct bd_err_detail *detail)
{
    const struct bd_program_source source = source_of(inputs, which);
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
    struct bd_bindings bindings = {0};
    bind_inputs(inputs, which == BD_COMPOSITE_NOISE || which == BD_COMPOSITE_BLUR, &bindings);
    bd_bind_image(&bindings, 0, layer, true, true);
    return run_rows(context, &source, &view, &bindings, &args, detail);
}

enum bd_err bd_composite_finish(const struct bd_pass_context *context,
                                const struct bd_composite_sums *inputs, uint32_t which,
                                struct bd_tex *layer, struct bd_err_detail *detail)
{
    struct bd_program_source source = {.compute = "pass/composite/finish.comp"};
    bd_define(&source.defines, "BD_LAYER", (int32_t)which);
    const struct bd_view view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space);
    struct bd_composite_args args = {.sub_frame_weight = 1.0f / (float)inputs->count};
    struct bd_bindings bindings = {0};
    bd_bind_image(&bindings, 0, layer, false, true);
    bd_bind_image(&bindings, 1, inputs->sums, true, false);
    return run_rows(context, &source, &view, &bindings, &args, detail);
}
