#include "pass/direct.h"

#include "pass/direct_native.h"
#include "shared/bindings.h"
#include "shared/direct.h"

// A pixel of one light against one unit, an evaluation of a VPL: nine looked-up triangles.
#define UNITS_PER_PIXEL 40.0

static void bind_light(struct bd_bindings *bindings, const struct bd_direct_inputs *inputs,
                       const struct bd_shadow_map *shadow_map)
{
    bd_gbuffer_bind(inputs->gbuffer, bindings);
    bindings->textures[BD_UNIT_GBUFFER_TRIANGLE].tex = inputs->gbuffer->triangle;
    bindings->textures[BD_UNIT_SHADOW_IDS].tex = shadow_map->ids;
    bindings->arrays[BD_UNIT_TRIANGLES] = inputs->scene->triangles;
}

static enum bd_err add_light(const struct bd_pass_context *context,
                             const struct bd_direct_inputs *inputs,
                             const struct bd_program *program, const struct bd_view *view,
                             uint32_t index, struct bd_tex *radiance)
{
    const struct bd_direct_light *light = &inputs->lights[index];
    const struct bd_light_uniform uniform = bd_light_setup_uniform(
        light->setup, &inputs->scene->space, light->shadow_map->side_px);
    const uint32_t width = inputs->viewpoint->width_px, height = inputs->viewpoint->height_px;
    uint32_t group[3];
    bd_program_group_size(program, group);
    bd_slicer_work(context->slicer, "direct");
    for (uint32_t row = 0; row < height;) {
        uint32_t rows = bd_slicer_rows(context->slicer, UNITS_PER_PIXEL * width, height - row);
        const struct bd_direct_args args = {
            .first_row = row, .row_count = rows, .is_first = index == 0};
        struct bd_bindings bindings = {0};
        bind_light(&bindings, inputs, light->shadow_map);
        bindings.images[0].tex = radiance;
        bindings.images[0].read = bindings.images[0].write = true;
        bindings.uniforms[BD_UNIFORM_VIEW].bytes = view;
        bindings.uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof *view;
        bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
        bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
        bindings.uniforms[BD_UNIFORM_LIGHT].bytes = &uniform;
        bindings.uniforms[BD_UNIFORM_LIGHT].size_bytes = sizeof uniform;
        bd_gpu_dispatch(context->gpu, program, &bindings, (width + group[0] - 1) / group[0],
                        (rows + group[1] - 1) / group[1], 1);
        enum bd_err err =
            bd_slicer_checkpoint(context->slicer, UNITS_PER_PIXEL * width * rows);
        if (err) return err;
        row += rows;
    }
    return BD_ERR_OK;
}

static enum bd_err add_lights(const struct bd_pass_context *context,
                              const struct bd_direct_inputs *inputs, struct bd_tex *radiance,
                              struct bd_err_detail *detail)
{
    struct bd_program_source source = {.compute = "pass/direct/direct.comp"};
    if (inputs->lambert) bd_define(&source.defines, "BD_LAMBERT", 1);
    struct bd_program *program;
    enum bd_err err = bd_program_get(context->gpu, &source, &program, detail);
    const struct bd_view view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space);
    for (uint32_t i = 0; !err && i < inputs->light_count; i++)
        err = add_light(context, inputs, program, &view, i, radiance);
    return err;
}

enum bd_err bd_direct_run(const struct bd_pass_context *context,
                          const struct bd_direct_inputs *inputs, struct bd_tex **out,
                          struct bd_err_detail *detail)
{
    const struct bd_tex_desc desc = {
        .name = "direct",
        .format = BD_FORMAT_RGBA32F,
        .width_px = inputs->viewpoint->width_px,
        .height_px = inputs->viewpoint->height_px,
    };
    struct bd_tex *radiance = NULL;
    enum bd_err err = bd_tex_create(context->gpu, &desc, &radiance, detail);
    if (err) return err;
    if (inputs->light_count > 0 && context->processor)
        err = bd_direct_native_run(context, inputs, radiance, detail);
    else if (inputs->light_count > 0)
        err = add_lights(context, inputs, radiance, detail);
    else
        bd_tex_clear(context->gpu, radiance, (const float[4]){0});
    if (err) {
        bd_tex_destroy(context->gpu, &radiance);
        return err;
    }
    *out = radiance;
    return BD_ERR_OK;
}
