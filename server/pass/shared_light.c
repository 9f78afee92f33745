#include "pass/shared_light.h"

#include <stdlib.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/shared_light.h"

// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_PIXEL 30.0

static struct bd_share_args args_of(const struct bd_shared_light_inputs *inputs)
{
    const struct bd_viewpoint *first = inputs->first_viewpoint;
    const struct bd_pixel_blocks *blocks = &inputs->blocks;
    return (struct bd_share_args){
        .first_sample_px = {(float)first->sample_x_px, (float)first->sample_y_px, 0, 0},
        .first_origin_px = {(float)blocks->left_px, (float)blocks->top_px, 0, 0},
        .first_side_px = (float)blocks->side_px,
    };
}

static void bind_first(const struct bd_shared_light_inputs *inputs, struct bd_bindings *bindings)
{
    const struct bd_indirect *first = inputs->first;
    bindings->textures[BD_UNIT_FIRST_DEPTH].tex = inputs->first_gbuffer->depth;
    bindings->textures[BD_UNIT_FIRST_NORMALS].tex = inputs->first_gbuffer->normals;
    bindings->textures[BD_UNIT_FIRST_MATERIAL].tex = inputs->first_gbuffer->material;
    bindings->textures[BD_UNIT_FIRST_IRRADIANCE].tex =
        first->vector ? first->gathered : first->irradiance;
    bindings->textures[BD_UNIT_FIRST_VECTOR].tex = first->vector;
    bindings->textures[BD_UNIT_FIRST_ROUGH].tex = first->rough;
    bindings->textures[BD_UNIT_FIRST_NOISE].tex = first->noise;
    bindings->textures[BD_UNIT_FIRST_NOISE_ROUGH].tex = first->noise_rough;
}

static enum bd_err run_rows(const struct bd_pass_context *context,
                            const struct bd_shared_light_inputs *inputs,
                            const struct bd_indirect *out, struct bd_err_detail *detail)
{
    const struct bd_view view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space);
    struct bd_share_args args = args_of(inputs);
    const struct bd_program *program;
    struct bd_defines defines = {0};
    if (inputs->first->vector) bd_define(&defines, "BD_VECTOR", 1);
    if (inputs->first->rough) bd_define(&defines, "BD_ROUGH", 1);
    if (inputs->first->noise) bd_define(&defines, "BD_NOISE", 1);
    if (inputs->first->noise_rough) bd_define(&defines, "BD_NOISE_ROUGH", 1);
    enum bd_err err = bd_compute_get(context->gpu, "pass/shared_light/shared_light.comp", &defines,
                                     &program, detail);
    struct bd_bindings bindings = {
        .uniforms[BD_UNIFORM_VIEW] = {&view, sizeof view},
        .uniforms[BD_UNIFORM_ARGS] = {&args, sizeof args},
    };
    bd_gbuffer_bind(inputs->gbuffer, &bindings);
    bind_first(inputs, &bindings);
    bd_bind_image(&bindings, 0, out->irradiance, false, true);
    bd_bind_image(&bindings, 1, out->rough, false, true);
    bd_bind_image(&bindings, 2, out->noise, false, true);
    bd_bind_image(&bindings, 3, out->noise_rough, false, true);
    const uint32_t width = view.size_px.x, height = view.size_px.y;
    bd_slicer_work(context->slicer, "share");
    for (uint32_t row = 0; !err && row < height;) {
        uint32_t rows = bd_slicer_rows(context->slicer, UNITS_PER_PIXEL * width, height - row);
        args.first_row = row;
        args.row_count = rows;
        bd_gpu_dispatch(context->gpu, program, &bindings, bd_divided_up(width, 8),
                        bd_divided_up(rows, 8), 1);
        err = bd_slicer_checkpoint(context->slicer, UNITS_PER_PIXEL * width * rows);
        row += rows;
    }
    return err;
}

// Beside irradiance what else the first sub-frame has.
static enum bd_err create_rest(struct bd_gpu *gpu, const struct bd_shared_light_inputs *inputs,
                               struct bd_indirect *out, struct bd_err_detail *detail)
{
    const struct bd_indirect *first = inputs->first;
    struct bd_tex_desc desc = {.name = "indirect light of rough lobes",
                               .format = BD_FORMAT_RGBA32F,
                               .width_px = inputs->viewpoint->width_px,
                               .height_px = inputs->viewpoint->height_px};
    enum bd_err err = first->rough ? bd_tex_create(gpu, &desc, &out->rough, detail) : BD_ERR_OK;
    desc.name = "noise that is taken over";
    if (!err && first->noise) err = bd_tex_create(gpu, &desc, &out->noise, detail);
    if (!err && first->noise_rough) err = bd_tex_create(gpu, &desc, &out->noise_rough, detail);
    return err;
}

// No blocks at all: its fragments are the pixels that nobody shares light with.
static enum bd_err create_pixels(struct bd_gpu *gpu, const struct bd_viewpoint *viewpoint,
                                 const struct bd_tex *irradiance, struct bd_discontinuity **out,
                                 struct bd_err_detail *detail)
{
    const uint32_t width = viewpoint->width_px, height = viewpoint->height_px;
    struct bd_discontinuity *made = *out = calloc(1, sizeof *made);
    BD_ASSERT(made);
    made->layout = bd_multires_layout_of(width, height, width > height ? width : height);
    made->lit = irradiance;
    struct bd_tex_desc desc = {.name = "no blocks", .format = BD_FORMAT_R32UI};
    bd_multires_stack_size(&made->layout, &desc.width_px, &desc.height_px);
    return bd_tex_create(gpu, &desc, &made->flags, detail);
}

static enum bd_err list_missing(const struct bd_pass_context *context,
                                const struct bd_shared_light_inputs *inputs,
                                struct bd_shared_light *light, struct bd_err_detail *detail)
{
    const struct bd_discontinuity_inputs seen = {
        .gbuffer = inputs->gbuffer,
        .viewpoint = inputs->viewpoint,
        .space = &inputs->scene->space,
    };
    enum bd_err err = create_pixels(context->gpu, inputs->viewpoint, light->indirect->irradiance,
                                    &light->pixels, detail);
    if (!err)
        err = bd_fragments_run(context, &seen, light->pixels, BD_REFINEMENT_ONE_PASS,
                               &light->missing, detail);
    if (!err) light->indirect->fragment_count = light->missing->count;
    return err;
}

enum bd_err bd_shared_light_run(const struct bd_pass_context *context,
                                const struct bd_shared_light_inputs *inputs,
                                struct bd_shared_light *out, struct bd_err_detail *detail)
{
    *out = (struct bd_shared_light){0};
    enum bd_err err =
        bd_indirect_create(context->gpu, inputs->viewpoint, false, &out->indirect, detail);
    if (!err) err = create_rest(context->gpu, inputs, out->indirect, detail);
    if (!err) err = run_rows(context, inputs, out->indirect, detail);
    if (!err) err = list_missing(context, inputs, out, detail);
    if (err) bd_shared_light_finish(context->gpu, out);
    return err;
}

void bd_shared_light_finish(struct bd_gpu *gpu, struct bd_shared_light *light)
{
    bd_indirect_destroy(gpu, &light->indirect);
    bd_discontinuity_destroy(gpu, &light->pixels);
    bd_fragments_destroy(gpu, &light->missing);
}
