#include "pass/gather_tree.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "pass/gather_native.h"
#include "pass/kernels.h"
#include "pass/tree_walk.h"
#include "shared/bindings.h"
#include "shared/gather_tree.h"

// A first guess at a receiver's cut, in the slicer's units; then each slice teaches the next.
#define UNITS_PER_RECEIVER 2000.0

#define FRAGMENTS_PER_ROW 64u     // a work group
#define GROUPS_MAX        65535u  // of a dispatch along one axis

struct gather_tree {
    const struct bd_pass_context *context;
    const struct bd_gather_tree_inputs *inputs;
    const struct bd_program *program, *estimate_program;
    struct bd_view view;
    struct bd_tree_walk walk;
    // Receivers by rows: a row of pixels each, or a work group of fragments. One of the two is
    // made.
    uint32_t row_count, row_width;
    struct bd_indirect *pixels;
    struct bd_multires_light *blocks;
};

static void bind_outputs(const struct gather_tree *g, struct bd_bindings *bindings)
{
    if (g->pixels) {
        bd_bind_image(bindings, 0, g->pixels->irradiance, true, true);
        bd_bind_image(bindings, 1, g->pixels->glossy, true, true);
        return;
    }
    bd_bind_image(bindings, 0, g->blocks->fine, true, true);
    bd_bind_image(bindings, 1, g->blocks->coarse, true, true);
    bd_bind_image(bindings, 2, g->blocks->fine_vector, true, true);
    bd_bind_image(bindings, 3, g->blocks->coarse_vector, true, true);
}

static void bind_blocks(const struct gather_tree *g, struct bd_bindings *bindings)
{
    const struct bd_fragments *fragments = g->inputs->fragments;
    bindings->textures[BD_UNIT_BLOCK_REPRESENTATIVE].tex = g->inputs->discontinuity->representative;
    bindings->storage[BD_STORAGE_FRAGMENTS].buf = fragments->list;
    bindings->storage[BD_STORAGE_FRAGMENTS].read = true;
    bindings->uniforms[BD_UNIFORM_MULTIRES].bytes = &fragments->layout;
    bindings->uniforms[BD_UNIFORM_MULTIRES].size_bytes = sizeof fragments->layout;
}

static void dispatch(const struct gather_tree *g, const struct bd_tree_roots *roots,
                     const struct bd_gather_tree_args *args)
{
    const struct bd_program *program = roots->estimate ? g->estimate_program : g->program;
    struct bd_bindings bindings = {.uniforms[BD_UNIFORM_VIEW] = {&g->view, sizeof g->view}};
    bd_gbuffer_bind(g->inputs->gbuffer, &bindings);
    bd_tree_walk_bind(&g->walk, roots, args, &bindings);
    if (g->blocks) bind_blocks(g, &bindings);
    if (!roots->estimate) bind_outputs(g, &bindings);
    uint32_t group[3];
    bd_program_group_size(program, group);
    uint32_t across = g->blocks ? args->fragment_count : args->column_count;
    uint32_t down = g->blocks ? 1 : args->row_count;
    bd_gpu_dispatch(g->context->gpu, program, &bindings, (across + group[0] - 1) / group[0],
                    (down + group[1] - 1) / group[1], 1);
}

// Rows of fragments in a slice. One is a work group, so there may be fewer than eight.
static uint32_t fragment_rows(const struct gather_tree *g, double units_per_row, uint32_t left)
{
    double fit = bd_slicer_units(g->context->slicer) / units_per_row;
    uint32_t most = left < GROUPS_MAX ? left : GROUPS_MAX;
    return fit < 1 ? 1 : fit < most ? (uint32_t)fit : most;
}

// Fragments from a first one on.
static enum bd_err light_fragments(struct gather_tree *g, const struct bd_tree_roots *roots,
                                   double units)
{
    struct bd_gather_tree_args args = bd_tree_walk_args(&g->walk, roots);
    for (uint32_t row = 0; row < g->row_count;) {
        uint32_t rows = fragment_rows(g, units * FRAGMENTS_PER_ROW, g->row_count - row);
        const uint32_t first = row * FRAGMENTS_PER_ROW, left = g->inputs->fragments->count - first;
        args.first_fragment = first;
        args.fragment_count = rows * FRAGMENTS_PER_ROW < left ? rows * FRAGMENTS_PER_ROW : left;
        dispatch(g, roots, &args);
        enum bd_err err = bd_slicer_checkpoint(g->context->slicer, units * args.fragment_count);
        if (err) return err;
        row += rows;
    }
    return BD_ERR_OK;
}

static enum bd_err light_pixels(struct gather_tree *g, const struct bd_tree_roots *roots,
                                double units)
{
    struct bd_gather_tree_args args = bd_tree_walk_args(&g->walk, roots);
    struct bd_tile tile = {0};
    while (bd_slicer_next_tile(g->context->slicer, units, g->row_width, g->row_count, &tile)) {
        args.first_row = tile.y;
        args.row_count = tile.height;
        args.first_column = tile.x;
        args.column_count = tile.width;
        dispatch(g, roots, &args);
        enum bd_err err =
            bd_slicer_checkpoint(g->context->slicer, units * tile.width * tile.height);
        if (err) return err;
    }
    return BD_ERR_OK;
}

// What a receiver's cut costs is not known before: the next slice is as long as this one says.
static enum bd_err gather_roots(void *user, const struct bd_tree_roots *roots)
{
    struct gather_tree *g = user;
    double units = roots->estimate ? roots->count : UNITS_PER_RECEIVER;
    bd_slicer_work(g->context->slicer, roots->estimate ? "gather_tree estimate"
                                       : g->blocks     ? "gather_tree fragments"
                                                       : "gather_tree");
    return g->blocks ? light_fragments(g, roots, units) : light_pixels(g, roots, units);
}

static enum bd_err get_programs(struct gather_tree *g, struct bd_err_detail *detail)
{
    struct bd_program_source source = {.compute = "pass/gather_tree/gather_tree.comp"};
    if (g->blocks) bd_define(&source.defines, "BD_FRAGMENTS", 1);
    if (g->blocks && g->inputs->vector) bd_define(&source.defines, "BD_VECTOR", 1);
    struct bd_program_source estimate = source; // of the same receivers
    // Printed formulas know no patches.
    const bool printed = g->inputs->criterion == BD_TREE_PRINTED;
    if (printed) bd_define(&source.defines, "BD_PRINTED", 1);
    if (g->inputs->near_patches && !printed) bd_define(&source.defines, "BD_VPL_PATCH", 1);
    if (g->pixels && g->inputs->glossy) bd_define(&source.defines, "BD_GLOSSY", 1);
    if (g->blocks && g->inputs->spread) bd_define(&source.defines, "BD_SPREAD", 1);
    bd_define(&estimate.defines, "BD_ESTIMATE", 1);
    struct bd_program *program = NULL, *estimate_program = NULL;
    enum bd_err err = bd_program_get(g->context->gpu, &source, &program, detail);
    if (!err) err = bd_program_get(g->context->gpu, &estimate, &estimate_program, detail);
    g->program = program;
    g->estimate_program = estimate_program;
    return err;
}

static struct gather_tree gather_tree_of(const struct bd_pass_context *context,
                                         const struct bd_gather_tree_inputs *inputs)
{
    return (struct gather_tree){
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
    };
}

static enum bd_err gather_all(struct gather_tree *g)
{
    enum bd_err err = bd_tree_walk_estimate(&g->walk, gather_roots, g);
    for (uint32_t i = 0; !err && i < g->inputs->tree_count; i++)
        err = bd_tree_walk_light(g->context->gpu, &g->walk, i, gather_roots, g);
    return err;
}

static void bind_pixels(const void *out, struct bd_bindings *bindings)
{
    const struct bd_indirect *pixels = out;
    bd_bind_image(bindings, 0, pixels->irradiance, false, true);
}

static enum bd_err run_native(const struct gather_tree *g, struct bd_err_detail *detail)
{
    const struct bd_gather_tree_inputs *in = g->inputs;
    const struct bd_receivers_inputs receivers = {
        .askers =
            {
                .viewpoint = in->viewpoint,
                .space = &in->scene->space,
                .gbuffer = in->gbuffer,
                .near_patches = in->near_patches,
                .fragments = g->blocks ? in->fragments : NULL,
                .discontinuity = in->discontinuity,
                .finest_level = in->finest_level,
                .vector = g->blocks && in->vector,
            },
        .spread = g->blocks && in->spread,
        .bind = g->blocks ? bd_multires_light_bind : bind_pixels,
        .out = g->blocks ? (const void *)g->blocks : g->pixels,
    };
    return bd_gather_tree_native_run(g->context, &receivers, in, detail);
}

// By loops of the processor, as far as there are any.
static bool is_native(const struct gather_tree *g)
{
    return g->context->processor && g->inputs->criterion != BD_TREE_PRINTED &&
           !(g->pixels && g->inputs->glossy);
}

static enum bd_err run(struct gather_tree *g, struct bd_err_detail *detail)
{
    if (is_native(g)) return run_native(g, detail);
    const size_t receivers = (size_t)g->row_width * g->row_count;
    enum bd_err err = get_programs(g, detail);
    if (!err) err = bd_tree_walk_begin(g->context->gpu, g->inputs, receivers, &g->walk, detail);
    if (!err) err = gather_all(g);
    bd_tree_walk_end(g->context->gpu, &g->walk);
    return err;
}

enum bd_err bd_gather_tree_run(const struct bd_pass_context *context,
                               const struct bd_gather_tree_inputs *inputs, struct bd_indirect **out,
                               struct bd_err_detail *detail)
{
    struct gather_tree g = gather_tree_of(context, inputs);
    g.row_count = g.view.size_px.y;
    g.row_width = g.view.size_px.x;
    enum bd_err err =
        bd_indirect_create(context->gpu, inputs->viewpoint, inputs->glossy, &g.pixels, detail);
    if (!err) err = run(&g, detail);
    if (err) {
        bd_indirect_destroy(context->gpu, &g.pixels);
        return err;
    }
    *out = g.pixels;
    return BD_ERR_OK;
}

enum bd_err bd_gather_tree_fragments_run(const struct bd_pass_context *context,
                                         const struct bd_gather_tree_inputs *inputs,
                                         struct bd_multires_light **out,
                                         struct bd_err_detail *detail)
{
    struct gather_tree g = gather_tree_of(context, inputs);
    g.row_count = (inputs->fragments->count + FRAGMENTS_PER_ROW - 1) / FRAGMENTS_PER_ROW;
    g.row_width = FRAGMENTS_PER_ROW;
    enum bd_err err = BD_ERR_OK;
    if (inputs->into)
        g.blocks = inputs->into;
    else
        err = bd_multires_light_create(
            context->gpu, &inputs->fragments->layout,
            inputs->vector ? BD_LIGHT_VECTORS_ALL : BD_LIGHT_VECTORS_NONE, &g.blocks, detail);
    if (!err) err = run(&g, detail);
    if (err) {
        if (!inputs->into) bd_multires_light_destroy(context->gpu, &g.blocks);
        return err;
    }
    *out = g.blocks;
    return BD_ERR_OK;
}
