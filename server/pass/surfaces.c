#include "pass/surfaces.h"

#include <stdlib.h>

#include "base/assert.h"
#include "shared/bindings.h"
#include "shared/surfaces.h"

// One block in the slicer's unit, an evaluation of a VPL; and one whose children are looked at.
#define UNITS_PER_BLOCK 64.0
#define UNITS_PER_OUTER 512.0
#define GROUP           64u // invocations of the kernel that walks a list
#define ITEMS_MAX       (65535u * GROUP)

struct work {
    const struct bd_pass_context *context;
    const struct bd_discontinuity_inputs *inputs;
    const struct bd_discontinuity *discontinuity;
    struct bd_view view;
    struct bd_buf *counts; // uint32 a level
    struct bd_surfaces *out;
};

static enum bd_err create_outputs(struct work *w, struct bd_fault *fault)
{
    static const uint32_t none[BD_MULTIRES_LEVEL_MAX];
    struct bd_gpu *gpu = w->context->gpu;
    struct bd_tex_desc desc = {.name = "surfaces of blocks", .format = BD_FORMAT_R32UI};
    bd_multires_stack_size(&w->discontinuity->layout, &desc.width_px, &desc.height_px);
    enum bd_err err = bd_tex_create(gpu, &desc, &w->out->words, fault);
    desc.name = "outer blocks";
    if (!err) err = bd_tex_create(gpu, &desc, &w->out->outer, fault);
    desc.name = "children of outer blocks";
    desc.format = BD_FORMAT_RG32UI;
    if (!err) err = bd_tex_create(gpu, &desc, &w->out->children, fault);
    if (!err) err = bd_buf_create(gpu, "outer counts", sizeof none, none, &w->counts, fault);
    return err;
}

static struct bd_bindings bind_look(const struct work *w)
{
    struct bd_bindings bindings = {
        .textures[BD_UNIT_BLOCK_FLAGS] = {.tex = w->discontinuity->flags},
        .textures[BD_UNIT_BLOCK_REPRESENTATIVE] = {.tex = w->discontinuity->representative},
        .images[0] = {.tex = w->out->words, .write = true},
        .uniforms[BD_UNIFORM_VIEW] = {&w->view, sizeof w->view},
    };
    bd_gbuffer_bind(w->inputs->gbuffer, &bindings);
    return bindings;
}

static struct bd_bindings bind_list(const struct work *w)
{
    return (struct bd_bindings){
        .textures[BD_UNIT_BLOCK_SURFACES] = {.tex = w->out->words},
        .images[0] = {.tex = w->out->outer, .write = true},
        .storage[BD_STORAGE_OUTER_COUNTS] = {.buf = w->counts, .read = true, .write = true},
    };
}

static struct bd_surfaces_args args_of(const struct work *w, uint32_t level)
{
    return (struct bd_surfaces_args){
        .rows = {0, 0, w->inputs->settings.finest_level, 0},
        .level = bd_multires_level(&w->discontinuity->layout, level),
        .finer = bd_multires_level(&w->discontinuity->layout, level - 1),
        .size_px = w->discontinuity->layout.size_px,
    };
}

static enum bd_err run_level(const struct work *w, const struct bd_program *program,
                             struct bd_bindings *bindings, uint32_t level)
{
    const struct bd_uvec4 blocks = w->discontinuity->layout.levels[level];
    const double units_per_row = UNITS_PER_BLOCK * blocks.x;
    struct bd_surfaces_args args = args_of(w, level);
    uint32_t group[3];
    bd_program_group_size(program, group);
    bindings->uniforms[BD_UNIFORM_ARGS].bytes = &args;
    bindings->uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
    for (uint32_t row = 0; row < blocks.y;) {
        uint32_t rows = bd_slicer_rows(w->context->slicer, units_per_row, blocks.y - row);
        args.rows.x = row;
        args.rows.y = rows;
        bd_gpu_dispatch(w->context->gpu, program, bindings, (blocks.x + group[0] - 1) / group[0],
                        (rows + group[1] - 1) / group[1], 1);
        row += rows;
        // The last slice is left to the next checkpoint: levels are many, and most are small.
        if (row == blocks.y) break;
        enum bd_err err = bd_slicer_checkpoint(w->context->slicer, 0);
        if (err) return err;
    }
    return BD_ERR_OK;
}

static enum bd_err run_levels(const struct work *w, const char *compute,
                              struct bd_bindings bindings, struct bd_fault *fault)
{
    const struct bd_program_source source = {.compute = compute};
    struct bd_program *program;
    enum bd_err err = bd_program_get(w->context->gpu, &source, &program, fault);
    for (uint32_t level = 1; !err && level < w->discontinuity->layout.size_px.z; level++)
        err = run_level(w, program, &bindings, level);
    return err;
}

static enum bd_err list_outer(struct work *w, struct bd_fault *fault)
{
    enum bd_err err = run_levels(w, "pass/surfaces/outer.comp", bind_list(w), fault);
    if (err) return err;
    return bd_buf_read(w->context->gpu, w->counts, 0, w->out->outer_count,
                       sizeof w->out->outer_count);
}

static enum bd_err look_at_children_of_level(const struct work *w, const struct bd_program *program,
                                             uint32_t level)
{
    struct bd_surfaces_args args = args_of(w, level);
    struct bd_bindings bindings = bind_look(w);
    bindings.textures[BD_UNIT_OUTER_BLOCKS].tex = w->out->outer;
    bindings.images[0].tex = w->out->children;
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
    for (uint32_t first = 0, end = w->out->outer_count[level]; first < end;) {
        uint32_t count = end - first < ITEMS_MAX ? end - first : ITEMS_MAX;
        count = bd_slicer_rows(w->context->slicer, UNITS_PER_OUTER, count);
        args.rows.x = first;
        args.rows.y = count;
        bd_gpu_dispatch(w->context->gpu, program, &bindings, (count + GROUP - 1) / GROUP, 1, 1);
        first += count;
        enum bd_err err = bd_slicer_checkpoint(w->context->slicer, UNITS_PER_OUTER * count);
        if (err) return err;
    }
    return BD_ERR_OK;
}

static enum bd_err look_at_children(const struct work *w, struct bd_fault *fault)
{
    const struct bd_program_source source = {.compute = "pass/surfaces/children.comp"};
    struct bd_program *program;
    enum bd_err err = bd_program_get(w->context->gpu, &source, &program, fault);
    for (uint32_t level = 1; !err && level < w->discontinuity->layout.size_px.z; level++)
        err = look_at_children_of_level(w, program, level);
    return err;
}

static enum bd_err run(struct work *w, struct bd_fault *fault)
{
    enum bd_err err = create_outputs(w, fault);
    if (!err) err = run_levels(w, "pass/surfaces/pairs.comp", bind_look(w), fault);
    if (!err) err = list_outer(w, fault);
    if (!err) err = look_at_children(w, fault);
    return err;
}

enum bd_err bd_surfaces_run(const struct bd_pass_context *context,
                            const struct bd_discontinuity_inputs *inputs,
                            const struct bd_discontinuity *discontinuity, struct bd_surfaces **out,
                            struct bd_fault *fault)
{
    struct work w = {
        .context = context,
        .inputs = inputs,
        .discontinuity = discontinuity,
        .view = bd_viewpoint_uniform(inputs->viewpoint, inputs->space),
        .out = calloc(1, sizeof *w.out),
    };
    BD_ASSERT(inputs->gbuffer && w.out);
    enum bd_err err = run(&w, fault);
    bd_buf_destroy(context->gpu, &w.counts);
    if (err) {
        bd_surfaces_destroy(context->gpu, &w.out);
        return err;
    }
    *out = w.out;
    return BD_ERR_OK;
}

void bd_surfaces_destroy(struct bd_gpu *gpu, struct bd_surfaces **surfaces)
{
    if (!*surfaces) return;
    bd_tex_destroy(gpu, &(*surfaces)->words);
    bd_tex_destroy(gpu, &(*surfaces)->outer);
    bd_tex_destroy(gpu, &(*surfaces)->children);
    free(*surfaces);
    *surfaces = NULL;
}

uint64_t bd_surfaces_bytes(const struct bd_surfaces *surfaces)
{
    return bd_tex_bytes(surfaces->words) + bd_tex_bytes(surfaces->outer) +
           bd_tex_bytes(surfaces->children);
}
