#include "pass/upsample.h"

#include <stdlib.h>

#include "base/assert.h"
#include "shared/bindings.h"
#include "shared/upsample.h"

_Static_assert(BD_SURFACE_DETAIL_OFF == BD_DETAIL_OFF, "the shader's numbers");
_Static_assert(BD_SURFACE_DETAIL_DIRECTION == BD_DETAIL_DIRECTION, "the shader's numbers");
_Static_assert(BD_SURFACE_DETAIL_PAPER == BD_DETAIL_PAPER, "the shader's numbers");

// Of the slicer, one for each evaluation of a VPL: a block costs about as much as so many.
#define UNITS_PER_BLOCK 64.0

struct upsample {
    const struct bd_pass_context *context;
    const struct bd_upsample_inputs *inputs;
    struct bd_view view;
    struct bd_indirect *out;
};

static void bind_image(struct bd_bindings *bindings, uint32_t unit, struct bd_tex *tex)
{
    bindings->images[unit].tex = tex;
    bindings->images[unit].read = bindings->images[unit].write = tex != NULL;
}

static struct bd_bindings bind(const struct upsample *u, uint32_t level,
                               const struct bd_upsample_args *args)
{
    const struct bd_multires_light *light = u->inputs->light;
    bool vector = u->inputs->detail == BD_SURFACE_DETAIL_DIRECTION;
    struct bd_bindings bindings = {
        .textures[BD_UNIT_BLOCK_REPRESENTATIVE] = {.tex = u->inputs->discontinuity->representative},
        .uniforms[BD_UNIFORM_VIEW] = {&u->view, sizeof u->view},
        .uniforms[BD_UNIFORM_MULTIRES] = {&light->layout, sizeof light->layout},
        .uniforms[BD_UNIFORM_ARGS] = {args, sizeof *args},
    };
    bd_gbuffer_bind(u->inputs->gbuffer, &bindings);
    bind_image(&bindings, 1, light->coarse);
    bind_image(&bindings, 3, vector ? light->coarse_vector : NULL);
    if (level > 0) return bindings;
    bindings.images[0].tex = u->out->irradiance;
    bindings.images[0].write = true;
    bindings.textures[BD_UNIT_FINE].tex = light->fine;
    bindings.textures[BD_UNIT_FINE_VECTOR].tex = vector ? light->fine_vector : NULL;
    return bindings;
}

static enum bd_err run_level(const struct upsample *u, uint32_t level, struct bd_fault *fault)
{
    struct bd_program_source source = {.compute = "pass/upsample/upsample.comp"};
    bd_define(&source.defines, "BD_DETAIL", (int32_t)u->inputs->detail);
    if (level == 0) bd_define(&source.defines, "BD_FINE", 1);
    struct bd_program *program;
    enum bd_err err = bd_program_get(u->context->gpu, &source, &program, fault);
    if (err) return err;
    uint32_t group[3];
    bd_program_group_size(program, group);
    const struct bd_uvec4 blocks = u->inputs->light->layout.levels[level];
    double units_per_row = blocks.x * UNITS_PER_BLOCK;
    for (uint32_t row = 0; row < blocks.y;) {
        uint32_t rows = bd_slicer_rows(u->context->slicer, units_per_row, blocks.y - row);
        const struct bd_upsample_args args = {.rows = {level, row, rows, 0}};
        const struct bd_bindings bindings = bind(u, level, &args);
        bd_gpu_dispatch(u->context->gpu, program, &bindings, (blocks.x + group[0] - 1) / group[0],
                        (rows + group[1] - 1) / group[1], 1);
        err = bd_slicer_checkpoint(u->context->slicer, units_per_row * rows);
        if (err) return err;
        row += rows;
    }
    return BD_ERR_OK;
}

static enum bd_err create_target(const struct upsample *u, struct bd_fault *fault)
{
    const struct bd_tex_desc desc = {
        .name = "indirect irradiance",
        .format = BD_FORMAT_RGBA32F,
        .width_px = u->inputs->light->layout.size_px.x,
        .height_px = u->inputs->light->layout.size_px.y,
    };
    return bd_tex_create(u->context->gpu, &desc, &u->out->irradiance, fault);
}

enum bd_err bd_upsample_run(const struct bd_pass_context *context,
                            const struct bd_upsample_inputs *inputs, struct bd_indirect **out,
                            struct bd_fault *fault)
{
    struct upsample u = {
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
        .out = calloc(1, sizeof *u.out),
    };
    BD_ASSERT(u.out);
    enum bd_err err = create_target(&u, fault);
    // The coarsest level's fragments have nothing above them.
    for (uint32_t level = inputs->light->layout.size_px.z - 1; !err && level > 1; level--)
        err = run_level(&u, level - 1, fault);
    if (!err) err = run_level(&u, 0, fault);
    if (err) {
        bd_indirect_destroy(context->gpu, &u.out);
        return err;
    }
    *out = u.out;
    return BD_ERR_OK;
}
