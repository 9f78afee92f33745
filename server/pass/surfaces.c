#include "pass/surfaces.h"

#include <stdlib.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/surfaces.h"

// One block in the slicer's unit, an evaluation of a VPL; one and its neighbours; one whose
// children are looked at.
#define UNITS_PER_BLOCK 8.0
#define UNITS_PER_PAIRS 64.0
#define UNITS_PER_OUTER 512.0

struct programs {
    const struct bd_program *look, *pairs, *outer, *children;
};

// As the kernels have them.
struct counts {
    uint32_t look, outer;
};

struct work {
    const struct bd_pass_context *context;
    const struct bd_discontinuity_inputs *inputs;
    const struct bd_discontinuity *discontinuity;
    struct bd_view view;
    struct bd_tex *pairs;  // R32UI stack
    struct bd_buf *look;   // uint32 BD_PIXEL_PACK: blocks of the level at hand to be looked at
    struct bd_buf *counts; // struct counts a level
    struct bd_surfaces *out;
};

// No list is longer than its level has blocks. Returns how many all of them are.
static uint32_t lay_out_lists(const struct bd_multires_layout *layout, struct bd_surfaces *out)
{
    uint32_t blocks = 0;
    for (uint32_t k = 1; k < layout->level_count; k++) {
        out->outer_first[k] = blocks;
        blocks += layout->levels[k].columns * layout->levels[k].rows;
    }
    return blocks;
}

static enum bd_err create_outputs(struct work *w, struct bd_err_detail *detail)
{
    static const struct counts none[BD_MULTIRES_LEVEL_MAX];
    struct bd_gpu *gpu = w->context->gpu;
    const struct bd_multires_layout *layout = &w->discontinuity->layout;
    const size_t blocks = lay_out_lists(layout, w->out);
    const size_t most =
        (size_t)layout->levels[1].columns * layout->levels[1].rows + 1; // level 1, if any
    struct bd_tex_desc desc = {.name = "surfaces of blocks", .format = BD_FORMAT_R32UI};
    bd_multires_stack_size(layout, &desc.width_px, &desc.height_px);
    enum bd_err err = bd_tex_create(gpu, &desc, &w->out->words, detail);
    desc.name = "pairs of blocks";
    if (!err) err = bd_tex_create(gpu, &desc, &w->pairs, detail);
    if (!err)
        err = bd_buf_create(gpu, "outer blocks", sizeof(uint32_t) * (blocks ? blocks : 1), NULL,
                            &w->out->outer, detail);
    if (!err)
        err = bd_buf_create(gpu, "blocks to be looked at", sizeof(uint32_t) * most, NULL, &w->look,
                            detail);
    if (!err) err = bd_buf_create(gpu, "counts of blocks", sizeof none, none, &w->counts, detail);
    return err;
}

static enum bd_err create_children(const struct work *w, struct bd_err_detail *detail)
{
    uint32_t count = 0;
    for (uint32_t k = 1; k < w->discontinuity->layout.level_count; k++) {
        w->out->children_first[k] = count;
        count += w->out->outer_count[k];
    }
    return bd_buf_create(w->context->gpu, "children of outer blocks",
                         2 * sizeof(uint32_t) * (count ? count : 1), NULL, &w->out->children,
                         detail);
}

// --- kernels ------------------------------------------------------------------------------

// What all of them may read, and the counts.
static struct bd_bindings bind_common(const struct work *w)
{
    struct bd_bindings bindings = {
        .textures[BD_UNIT_BLOCK_FLAGS] = {.tex = w->discontinuity->flags},
        .textures[BD_UNIT_BLOCK_REPRESENTATIVE] = {.tex = w->discontinuity->representative},
        .uniforms[BD_UNIFORM_VIEW] = {&w->view, sizeof w->view},
    };
    bd_gbuffer_bind(w->inputs->gbuffer, &bindings);
    bd_bind_storage(&bindings, BD_STORAGE_SURFACE_COUNTS, w->counts, true, true);
    return bindings;
}

static struct bd_bindings bind_look(const struct work *w)
{
    struct bd_bindings bindings = bind_common(w);
    bindings.textures[BD_UNIT_BLOCK_SURFACES].tex = w->out->words;
    bd_bind_image(&bindings, 0, w->out->words, false, true);
    bd_bind_image(&bindings, 1, w->pairs, false, true);
    bd_bind_storage(&bindings, BD_STORAGE_LOOK_BLOCKS, w->look, false, true);
    return bindings;
}

static struct bd_bindings bind_pairs(const struct work *w)
{
    struct bd_bindings bindings = bind_common(w);
    bd_bind_image(&bindings, 0, w->pairs, false, true);
    bd_bind_storage(&bindings, BD_STORAGE_LOOK_BLOCKS, w->look, true, false);
    return bindings;
}

static struct bd_bindings bind_outer(const struct work *w)
{
    struct bd_bindings bindings = bind_common(w);
    bindings.textures[BD_UNIT_BLOCK_PAIRS].tex = w->pairs;
    bd_bind_image(&bindings, 0, w->out->words, false, true);
    bd_bind_storage(&bindings, BD_STORAGE_LOOK_BLOCKS, w->look, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_OUTER_BLOCKS, w->out->outer, false, true);
    return bindings;
}

static struct bd_bindings bind_children(const struct work *w)
{
    struct bd_bindings bindings = bind_common(w);
    bd_bind_storage(&bindings, BD_STORAGE_OUTER_BLOCKS, w->out->outer, true, false);
    bd_bind_storage(&bindings, BD_STORAGE_OUTER_CHILDREN, w->out->children, false, true);
    return bindings;
}

static struct bd_surfaces_args args_of(const struct work *w, uint32_t level)
{
    const struct bd_multires_layout *layout = &w->discontinuity->layout;
    return (struct bd_surfaces_args){
        .finest_level = w->inputs->settings.finest_level,
        .first_outer = w->out->outer_first[level],
        .level = bd_multires_level(layout, level),
        .finer = bd_multires_level(layout, level - 1),
        .coarser = bd_multires_level(layout, level + 1),
        .width_px = layout->width_px,
        .height_px = layout->height_px,
        .first_children = w->out->children_first[level],
    };
}

static enum bd_err run_level(const struct work *w, const struct bd_program *program,
                             struct bd_bindings bindings, uint32_t level)
{
    const struct bd_multires_level blocks = w->discontinuity->layout.levels[level];
    const double units_per_row = UNITS_PER_BLOCK * blocks.columns;
    struct bd_surfaces_args args = args_of(w, level);
    uint32_t group[3];
    bd_program_group_size(program, group);
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
    bd_slicer_work(w->context->slicer, "surfaces");
    for (uint32_t row = 0; row < blocks.rows;) {
        uint32_t rows = bd_slicer_rows(w->context->slicer, units_per_row, blocks.rows - row);
        args.first_row = row;
        args.row_count = rows;
        bd_gpu_dispatch(w->context->gpu, program, &bindings,
                        (blocks.columns + group[0] - 1) / group[0],
                        (rows + group[1] - 1) / group[1], 1);
        row += rows;
        // The last slice is left to the next checkpoint: levels are many, and most are small.
        if (row == blocks.rows) break;
        enum bd_err err = bd_slicer_checkpoint(w->context->slicer, units_per_row * rows);
        if (err) return err;
    }
    return BD_ERR_OK;
}

// The first `count` of a list of the level's.
static enum bd_err run_list(const struct work *w, const struct bd_program *program, double units,
                            struct bd_bindings bindings, uint32_t level, uint32_t count)
{
    struct bd_surfaces_args args = args_of(w, level);
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
    bd_slicer_work(w->context->slicer, "surfaces list");
    for (uint32_t first = 0; first < count;) {
        uint32_t items = bd_list_slice(w->context->slicer, units, count - first);
        args.first_item = first;
        args.item_count = items;
        bd_gpu_dispatch(w->context->gpu, program, &bindings, bd_divided_up(items, BD_LIST_GROUP), 1,
                        1);
        first += items;
        enum bd_err err = bd_slicer_checkpoint(w->context->slicer, units * items);
        if (err) return err;
    }
    return BD_ERR_OK;
}

// What is under a deep block is known by that, so the levels above must be done.
static enum bd_err find_outer_of_level(const struct work *w, const struct programs *programs,
                                       uint32_t level)
{
    struct counts counts[BD_MULTIRES_LEVEL_MAX];
    enum bd_err err = run_level(w, programs->look, bind_look(w), level);
    if (!err) err = bd_buf_read(w->context->gpu, w->counts, 0, counts, sizeof counts);
    if (err) return err;
    const uint32_t look = counts[level].look;
    err = run_list(w, programs->pairs, UNITS_PER_PAIRS, bind_pairs(w), level, look);
    return err ? err : run_list(w, programs->outer, UNITS_PER_BLOCK, bind_outer(w), level, look);
}

static enum bd_err find_outer(const struct work *w, const struct programs *programs)
{
    struct counts counts[BD_MULTIRES_LEVEL_MAX];
    enum bd_err err = BD_ERR_OK;
    for (uint32_t level = w->discontinuity->layout.level_count; !err && level-- > 1;)
        err = find_outer_of_level(w, programs, level);
    if (!err) err = bd_buf_read(w->context->gpu, w->counts, 0, counts, sizeof counts);
    for (uint32_t k = 0; !err && k < BD_MULTIRES_LEVEL_MAX; k++)
        w->out->outer_count[k] = counts[k].outer;
    return err;
}

static enum bd_err look_at_children(const struct work *w, const struct programs *programs)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t k = 1; !err && k < w->discontinuity->layout.level_count; k++)
        err = run_list(w, programs->children, UNITS_PER_OUTER, bind_children(w), k,
                       w->out->outer_count[k]);
    return err;
}

static enum bd_err get_programs(struct bd_gpu *gpu, struct programs *out,
                                struct bd_err_detail *detail)
{
    enum bd_err err = bd_compute_get(gpu, "pass/surfaces/look.comp", NULL, &out->look, detail);
    if (!err) err = bd_compute_get(gpu, "pass/surfaces/pairs.comp", NULL, &out->pairs, detail);
    if (!err) err = bd_compute_get(gpu, "pass/surfaces/outer.comp", NULL, &out->outer, detail);
    if (!err)
        err = bd_compute_get(gpu, "pass/surfaces/children.comp", NULL, &out->children, detail);
    return err;
}

// --- the pass -----------------------------------------------------------------------------

static enum bd_err run(struct work *w, struct bd_err_detail *detail)
{
    struct programs programs;
    enum bd_err err = get_programs(w->context->gpu, &programs, detail);
    if (!err) err = create_outputs(w, detail);
    if (!err) err = find_outer(w, &programs);
    if (!err) err = create_children(w, detail);
    if (!err) err = look_at_children(w, &programs);
    return err;
}

enum bd_err bd_surfaces_run(const struct bd_pass_context *context,
                            const struct bd_discontinuity_inputs *inputs,
                            const struct bd_discontinuity *discontinuity, struct bd_surfaces **out,
                            struct bd_err_detail *detail)
{
    struct work w = {
        .context = context,
        .inputs = inputs,
        .discontinuity = discontinuity,
        .view = bd_viewpoint_uniform(inputs->viewpoint, inputs->space),
        .out = calloc(1, sizeof *w.out),
    };
    BD_ASSERT(inputs->gbuffer && w.out);
    enum bd_err err = run(&w, detail);
    bd_tex_destroy(context->gpu, &w.pairs);
    bd_buf_destroy(context->gpu, &w.look);
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
    bd_buf_destroy(gpu, &(*surfaces)->outer);
    bd_buf_destroy(gpu, &(*surfaces)->children);
    free(*surfaces);
    *surfaces = NULL;
}

uint64_t bd_surfaces_bytes(const struct bd_surfaces *surfaces)
{
    return bd_tex_bytes(surfaces->words) + bd_buf_size_bytes(surfaces->outer) +
           bd_buf_size_bytes(surfaces->children);
}
