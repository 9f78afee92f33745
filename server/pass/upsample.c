#include "pass/upsample.h"

#include <stdlib.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/upsample.h"

_Static_assert(BD_SURFACE_DETAIL_OFF == BD_DETAIL_OFF, "the shader's numbers");
_Static_assert(BD_SURFACE_DETAIL_DIRECTION == BD_DETAIL_DIRECTION, "the shader's numbers");
_Static_assert(BD_SURFACE_DETAIL_PAPER == BD_DETAIL_PAPER, "the shader's numbers");

// Of the slicer, one for each evaluation of a VPL: what a parent and its children cost about.
#define UNITS_PER_INNER 64.0
#define UNITS_PER_OUTER 512.0

struct upsample {
    const struct bd_pass_context *context;
    const struct bd_upsample_inputs *inputs;
    struct bd_view view;
    struct bd_indirect *out;
};

static bool has_fine_vector(const struct upsample *u)
{
    return u->inputs->detail == BD_SURFACE_DETAIL_DIRECTION && u->inputs->light->fine_vector;
}

static struct bd_bindings bind(const struct upsample *u, uint32_t level,
                               const struct bd_upsample_args *args)
{
    const struct bd_multires_light *light = u->inputs->light;
    bool vector = u->inputs->detail == BD_SURFACE_DETAIL_DIRECTION;
    struct bd_bindings bindings = {
        .textures[BD_UNIT_BLOCK_SURFACES] = {.tex = u->inputs->surfaces->words},
        .uniforms[BD_UNIFORM_VIEW] = {&u->view, sizeof u->view},
        .uniforms[BD_UNIFORM_MULTIRES] = {&light->layout, sizeof light->layout},
        .uniforms[BD_UNIFORM_ARGS] = {args, sizeof *args},
    };
    bd_gbuffer_bind(u->inputs->gbuffer, &bindings);
    bd_bind_image(&bindings, 1, light->coarse, true, true);
    bd_bind_image(&bindings, 3, vector ? light->coarse_vector : NULL, true, true);
    if (level > 0) return bindings;
    bd_bind_image(&bindings, 2, u->out->gathered, false, true);
    bd_bind_image(&bindings, 4, u->out->vector, false, true);
    bindings.images[0].tex = u->out->irradiance;
    bindings.images[0].write = true;
    bindings.textures[BD_UNIT_FINE].tex = light->fine;
    bindings.textures[BD_UNIT_FINE_VECTOR].tex = has_fine_vector(u) ? light->fine_vector : NULL;
    return bindings;
}

static enum bd_err get_program(const struct upsample *u, const char *compute, uint32_t level,
                               struct bd_program **out, struct bd_err_detail *detail)
{
    struct bd_program_source source = {.compute = compute};
    bd_define(&source.defines, "BD_DETAIL", (int32_t)u->inputs->detail);
    if (level == 0) bd_define(&source.defines, "BD_FINE", 1);
    if (level == 0 && has_fine_vector(u)) bd_define(&source.defines, "BD_FINE_VECTOR", 1);
    if (level == 0 && u->inputs->keep_vector) bd_define(&source.defines, "BD_KEEP_VECTOR", 1);
    return bd_program_get(u->context->gpu, &source, out, detail);
}

static struct bd_upsample_args args_of(const struct upsample *u, uint32_t level)
{
    const struct bd_multires_layout *layout = &u->inputs->light->layout;
    return (struct bd_upsample_args){
        .level = bd_multires_level(layout, level),
        .above = bd_multires_level(layout, level + 1),
    };
}

static enum bd_err run_inner(const struct upsample *u, uint32_t level, struct bd_err_detail *detail)
{
    struct bd_program *program;
    enum bd_err err = get_program(u, "pass/upsample/inner.comp", level, &program, detail);
    if (err) return err;
    struct bd_upsample_args args = args_of(u, level);
    uint32_t group[3], columns = (args.level.columns + 1) / 2, height = (args.level.rows + 1) / 2;
    bd_program_group_size(program, group);
    double units_per_row = columns * UNITS_PER_INNER;
    bd_slicer_work(u->context->slicer, "upsample");
    for (uint32_t row = 0; row < height;) {
        uint32_t rows = bd_slicer_rows(u->context->slicer, units_per_row, height - row);
        args.first_row = row;
        args.row_count = rows;
        const struct bd_bindings bindings = bind(u, level, &args);
        bd_gpu_dispatch(u->context->gpu, program, &bindings, (columns + group[0] - 1) / group[0],
                        (rows + group[1] - 1) / group[1], 1);
        err = bd_slicer_checkpoint(u->context->slicer, units_per_row * rows);
        if (err) return err;
        row += rows;
    }
    return BD_ERR_OK;
}

// The items [first, end) of a list; of fragments, or without any of the level's outer blocks.
static enum bd_err run_list(const struct upsample *u, const char *compute, uint32_t level,
                            struct bd_buf *fragments, uint32_t first, uint32_t end,
                            struct bd_err_detail *detail)
{
    const struct bd_surfaces *surfaces = u->inputs->surfaces;
    struct bd_program *program;
    enum bd_err err = get_program(u, compute, level, &program, detail);
    struct bd_upsample_args args = args_of(u, level);
    args.first_outer = surfaces->outer_first[level + 1];
    args.first_children = surfaces->children_first[level + 1];
    bd_slicer_work(u->context->slicer, "upsample list");
    while (!err && first < end) {
        uint32_t count = bd_list_slice(u->context->slicer, UNITS_PER_OUTER, end - first);
        args.first_item = first;
        args.item_count = count;
        struct bd_bindings bindings = bind(u, level, &args);
        bd_bind_storage(&bindings, BD_STORAGE_OUTER_BLOCKS, surfaces->outer, true, false);
        bd_bind_storage(&bindings, BD_STORAGE_OUTER_CHILDREN, surfaces->children, true, false);
        bd_bind_storage(&bindings, BD_STORAGE_FRAGMENTS, fragments, fragments != NULL, false);
        bd_gpu_dispatch(u->context->gpu, program, &bindings, bd_divided_up(count, BD_LIST_GROUP), 1,
                        1);
        err = bd_slicer_checkpoint(u->context->slicer, UNITS_PER_OUTER * count);
        first += count;
    }
    return err;
}

static enum bd_err run_own(const struct upsample *u, const struct bd_fragments *fragments,
                           struct bd_err_detail *detail)
{
    uint32_t first = fragments->level_first[0], count = fragments->level_count[0];
    return run_list(u, "pass/upsample/own.comp", 0, fragments->list, first, first + count, detail);
}

static enum bd_err run_level(const struct upsample *u, uint32_t level, struct bd_err_detail *detail)
{
    uint32_t outer = 0;
    if (level + 1 < u->inputs->light->layout.level_count)
        outer = u->inputs->surfaces->outer_count[level + 1];
    enum bd_err err = run_inner(u, level, detail);
    if (!err) err = run_list(u, "pass/upsample/outer.comp", level, NULL, 0, outer, detail);
    if (err || level > 0) return err;
    err = run_own(u, u->inputs->fragments, detail);
    for (uint32_t i = 0; !err && i < u->inputs->part_count; i++)
        err = run_own(u, u->inputs->parts[i], detail);
    return err;
}

static enum bd_err create_target(const struct upsample *u, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = u->context->gpu;
    struct bd_tex_desc desc = {
        .name = "indirect irradiance",
        .format = BD_FORMAT_RGBA32F,
        .width_px = u->inputs->light->layout.width_px,
        .height_px = u->inputs->light->layout.height_px,
    };
    enum bd_err err = bd_tex_create(gpu, &desc, &u->out->irradiance, detail);
    if (err || !u->inputs->keep_vector) return err;
    desc.name = "indirect, before normals";
    err = bd_tex_create(gpu, &desc, &u->out->gathered, detail);
    desc.name = "indirect, vector";
    return err ? err : bd_tex_create(gpu, &desc, &u->out->vector, detail);
}

enum bd_err bd_upsample_run(const struct bd_pass_context *context,
                            const struct bd_upsample_inputs *inputs, struct bd_indirect **out,
                            struct bd_err_detail *detail)
{
    struct upsample u = {
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
        .out = calloc(1, sizeof *u.out),
    };
    BD_ASSERT(u.out);
    enum bd_err err = create_target(&u, detail);
    // The coarsest level's fragments have nothing above them.
    for (uint32_t level = inputs->light->layout.level_count - 1; !err && level > 1; level--)
        err = run_level(&u, level - 1, detail);
    if (!err) err = run_level(&u, 0, detail);
    if (err) {
        bd_indirect_destroy(context->gpu, &u.out);
        return err;
    }
    *out = u.out;
    return BD_ERR_OK;
}
