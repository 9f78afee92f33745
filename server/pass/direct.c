#include "pass/direct.h"

#include <stdlib.h>

#include "base/assert.h"
#include "pass/direct_native.h"
#include "pass/kernels.h"
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
                             uint32_t index, const struct bd_direct *out)
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
        bd_bind_image(&bindings, 0, out->radiance, true, true);
        bd_bind_image(&bindings, 1, out->irradiance, true, true);
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
                              const struct bd_direct_inputs *inputs, const struct bd_direct *out,
                              struct bd_err_detail *detail)
{
    struct bd_program_source source = {.compute = "pass/direct/direct.comp"};
    if (inputs->lambert) bd_define(&source.defines, "BD_LAMBERT", 1);
    if (inputs->irradiance) bd_define(&source.defines, "BD_IRRADIANCE", 1);
    struct bd_program *program;
    enum bd_err err = bd_program_get(context->gpu, &source, &program, detail);
    const struct bd_view view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space);
    for (uint32_t i = 0; !err && i < inputs->light_count; i++)
        err = add_light(context, inputs, program, &view, i, out);
    return err;
}

static enum bd_err make(const struct bd_pass_context *context,
                        const struct bd_direct_inputs *inputs, struct bd_direct *out,
                        struct bd_err_detail *detail)
{
    struct bd_tex_desc desc = {
        .name = "direct",
        .format = BD_FORMAT_RGBA32F,
        .width_px = inputs->viewpoint->width_px,
        .height_px = inputs->viewpoint->height_px,
    };
    enum bd_err err = bd_tex_create(context->gpu, &desc, &out->radiance, detail);
    desc.name = "direct irradiance";
    if (!err && inputs->irradiance)
        err = bd_tex_create(context->gpu, &desc, &out->irradiance, detail);
    return err;
}

static void make_black(struct bd_gpu *gpu, const struct bd_direct *out)
{
    bd_tex_clear(gpu, out->radiance, (const float[4]){0});
    if (out->irradiance) bd_tex_clear(gpu, out->irradiance, (const float[4]){0});
}

enum bd_err bd_direct_run(const struct bd_pass_context *context,
                          const struct bd_direct_inputs *inputs, struct bd_direct **out,
                          struct bd_err_detail *detail)
{
    *out = calloc(1, sizeof **out);
    BD_ASSERT(*out);
    enum bd_err err = make(context, inputs, *out, detail);
    if (!err && inputs->light_count == 0)
        make_black(context->gpu, *out);
    else if (!err)
        err = context->processor ? bd_direct_native_run(context, inputs, *out, detail)
                                 : add_lights(context, inputs, *out, detail);
    if (err) bd_direct_destroy(context->gpu, out);
    return err;
}

void bd_direct_destroy(struct bd_gpu *gpu, struct bd_direct **direct)
{
    if (!*direct) return;
    bd_tex_destroy(gpu, &(*direct)->radiance);
    bd_tex_destroy(gpu, &(*direct)->irradiance);
    free(*direct);
    *direct = NULL;
}

uint64_t bd_direct_bytes(const struct bd_direct *direct)
{
    return bd_tex_bytes(direct->radiance) +
           (direct->irradiance ? bd_tex_bytes(direct->irradiance) : 0);
}
