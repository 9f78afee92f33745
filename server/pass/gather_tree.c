#include "pass/gather_tree.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"
#include "shared/gather_tree.h"

_Static_assert(BD_TREE_LIGHTCUTS == BD_TREE_CRITERION_LIGHTCUTS, "C and GLSL agree");
_Static_assert(BD_TREE_BOUND == BD_TREE_CRITERION_BOUND, "C and GLSL agree");
_Static_assert(BD_TREE_LEVEL == BD_TREE_CRITERION_LEVEL, "C and GLSL agree");
_Static_assert(BD_TREE_PRINTED == BD_TREE_CRITERION_PRINTED, "C and GLSL agree");

// Nodes that a receiver visits in a round, at most: all of the largest root. A fixed number,
// because it sets the order of the sums. A leaf costs an invocation a dozen rounds of its loops if
// it is near.
#define LEAVES_PER_ROUND (BD_TREE_ROOT_LEAVES_MAX * BD_TREE_ROOT_LEAVES_MAX)
#define NODES_PER_ROUND  ((4 * LEAVES_PER_ROUND - 1) / 3)
// A first guess at a receiver's cut, in the slicer's units; then each slice teaches the next.
#define UNITS_PER_RECEIVER 2000.0

#define ESTIMATE_STEPS    65536.0 // of the frame's mean irradiance
#define FRAGMENTS_PER_ROW 64u     // a work group
#define GROUPS_MAX        65535u  // of a dispatch along one axis

struct gather_tree {
    const struct bd_pass_context *context;
    const struct bd_gather_tree_inputs *inputs;
    const struct bd_program *program, *estimate_program;
    struct bd_view view;
    double mean_irradiance; // of the frame
    struct bd_buf *estimates, *next_roots;
    uint32_t round; // counted over all lights, from 1
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

static void dispatch(const struct gather_tree *g, uint32_t light, bool estimate,
                     const struct bd_gather_tree_args *args)
{
    const struct bd_program *program = estimate ? g->estimate_program : g->program;
    struct bd_bindings bindings = {
        .uniforms[BD_UNIFORM_VIEW] = {&g->view, sizeof g->view},
        .uniforms[BD_UNIFORM_TREE] = {args, sizeof *args},
        .storage[BD_STORAGE_ESTIMATES] = {.buf = g->estimates, .read = true, .write = estimate},
        .storage[BD_STORAGE_NEXT_ROOTS] = {.buf = g->next_roots, .read = true, .write = !estimate},
    };
    bd_gbuffer_bind(g->inputs->gbuffer, &bindings);
    bindings.arrays[BD_UNIT_VPLS] = g->inputs->leaves[light]->vpls;
    bindings.arrays[BD_UNIT_VPL_QUADS] = g->inputs->leaves[light]->quads;
    bindings.arrays[BD_UNIT_TREE_NODES] = g->inputs->trees[light]->nodes;
    if (g->blocks) bind_blocks(g, &bindings);
    if (!estimate) bind_outputs(g, &bindings);
    uint32_t group[3];
    bd_program_group_size(program, group);
    uint32_t across = g->blocks ? args->rows.y : args->blocks.z;
    uint32_t down = g->blocks ? 1 : args->rows.y;
    bd_gpu_dispatch(g->context->gpu, program, &bindings, (across + group[0] - 1) / group[0],
                    (down + group[1] - 1) / group[1], 1);
}

static size_t receivers(const struct gather_tree *g)
{
    return (size_t)g->row_width * g->row_count;
}

// Rows of fragments in a slice. One is a work group, so there may be fewer than eight.
static uint32_t fragment_rows(const struct gather_tree *g, double units_per_row, uint32_t left)
{
    double fit = bd_slicer_units(g->context->slicer) / units_per_row;
    uint32_t most = left < GROUPS_MAX ? left : GROUPS_MAX;
    return fit < 1 ? 1 : fit < most ? (uint32_t)fit : most;
}

// Some of a tree's roots; a round of all of them, or the estimate by a few.
struct roots {
    uint32_t light, first, count;
    bool estimate;
    bool goes_on; // from where the round before ended
    bool anew;    // nothing was added yet
};

static struct bd_gather_tree_args args_of(const struct gather_tree *g, const struct roots *roots)
{
    const struct bd_vpl_tree *tree = g->inputs->trees[roots->light];
    const uint32_t root_leaves = tree->leaf_side / tree->root_side;
    const double per_m2 = pow(g->inputs->scene->space.render_per_m, -2);
    return (struct bd_gather_tree_args){
        .rows = {0, 0, roots->anew, roots->goes_on},
        .tree = {roots->first, roots->count, tree->root_side, bd_vpl_tree_level_count(tree)},
        .cut = {(uint32_t)g->inputs->criterion, NODES_PER_ROUND,
                (4 * root_leaves * root_leaves - 1) / 3, g->round},
        .tau = {(float)g->inputs->tau, (float)(g->inputs->tau * g->mean_irradiance),
                (float)(BD_TREE_ESTIMATE_MIN * g->mean_irradiance),
                (float)(ESTIMATE_STEPS / g->mean_irradiance)},
        .light = {(float)(tree->intensity * tree->face_extent), (float)tree->face_extent,
                  (float)per_m2, 0},
        .blocks = {g->inputs->finest_level, 0, 0, 0},
    };
}

// Fragments from a first one on.
static enum bd_err light_fragments(struct gather_tree *g, const struct roots *roots, double units)
{
    struct bd_gather_tree_args args = args_of(g, roots);
    for (uint32_t row = 0; row < g->row_count;) {
        uint32_t rows = fragment_rows(g, units * FRAGMENTS_PER_ROW, g->row_count - row);
        const uint32_t first = row * FRAGMENTS_PER_ROW, left = g->inputs->fragments->count - first;
        args.rows.x = first;
        args.rows.y = rows * FRAGMENTS_PER_ROW < left ? rows * FRAGMENTS_PER_ROW : left;
        dispatch(g, roots->light, roots->estimate, &args);
        enum bd_err err = bd_slicer_checkpoint(g->context->slicer, units * args.rows.y);
        if (err) return err;
        row += rows;
    }
    return BD_ERR_OK;
}

static enum bd_err light_pixels(struct gather_tree *g, const struct roots *roots, double units)
{
    struct bd_gather_tree_args args = args_of(g, roots);
    struct bd_tile tile = {0};
    while (bd_slicer_next_tile(g->context->slicer, units, g->row_width, g->row_count, &tile)) {
        args.rows.x = tile.y;
        args.rows.y = tile.height;
        args.blocks.y = tile.x;
        args.blocks.z = tile.width;
        dispatch(g, roots->light, roots->estimate, &args);
        enum bd_err err =
            bd_slicer_checkpoint(g->context->slicer, units * tile.width * tile.height);
        if (err) return err;
    }
    return BD_ERR_OK;
}

// What a receiver's cut costs is not known before: the next slice is as long as this one says.
static enum bd_err gather_roots(struct gather_tree *g, const struct roots *roots)
{
    double units = roots->estimate ? roots->count : UNITS_PER_RECEIVER;
    bd_slicer_work(g->context->slicer, roots->estimate ? "gather_tree estimate"
                                       : g->blocks     ? "gather_tree fragments"
                                                       : "gather_tree");
    return g->blocks ? light_fragments(g, roots, units) : light_pixels(g, roots, units);
}

static uint32_t root_count(const struct bd_vpl_tree *tree)
{
    return tree->root_side * tree->root_side * tree->face_count;
}

static enum bd_err estimate(struct gather_tree *g, uint32_t light)
{
    struct roots roots = {.light = light, .estimate = true};
    for (const uint32_t end = root_count(g->inputs->trees[light]); roots.first < end;) {
        roots.count = end - roots.first < LEAVES_PER_ROUND ? end - roots.first : LEAVES_PER_ROUND;
        roots.anew = light == 0 && roots.first == 0;
        enum bd_err err = gather_roots(g, &roots);
        if (err) return err;
        roots.first += roots.count;
    }
    return BD_ERR_OK;
}

// Rounds until each receiver has been through the tree: one, unless tau is very small.
static enum bd_err gather_tree(struct gather_tree *g, uint32_t light)
{
    const struct bd_vpl_tree *tree = g->inputs->trees[light];
    struct roots roots = {.light = light, .count = root_count(tree), .anew = light == 0};
    BD_ASSERT_CMP(tree->leaf_side / tree->root_side, <=, BD_TREE_ROOT_LEAVES_MAX);
    uint32_t unfinished = 0;
    do {
        g->round++;
        enum bd_err err = gather_roots(g, &roots);
        if (!err)
            err = bd_buf_read(g->context->gpu, g->next_roots, 0, &unfinished, sizeof unfinished);
        if (err) return err;
        roots.goes_on = true;
        roots.anew = false;
    } while (unfinished == g->round);
    return BD_ERR_OK;
}

static enum bd_err gather_all(struct gather_tree *g)
{
    enum bd_err err = BD_ERR_OK;
    if (g->inputs->criterion == BD_TREE_LIGHTCUTS)
        for (uint32_t i = 0; !err && i < g->inputs->tree_count; i++) err = estimate(g, i);
    for (uint32_t i = 0; !err && i < g->inputs->tree_count; i++) err = gather_tree(g, i);
    return err;
}

static enum bd_err get_programs(struct gather_tree *g, struct bd_fault *fault)
{
    struct bd_program_source source = {.compute = "pass/gather_tree/gather_tree.comp"};
    if (g->blocks) bd_define(&source.defines, "BD_FRAGMENTS", 1);
    struct bd_program_source estimate = source;
    // Printed formulas know no patches.
    const bool printed = g->inputs->criterion == BD_TREE_PRINTED;
    if (printed) bd_define(&source.defines, "BD_PRINTED", 1);
    if (g->inputs->near_patches && !printed) bd_define(&source.defines, "BD_VPL_PATCH", 1);
    if (g->pixels && g->inputs->glossy) bd_define(&source.defines, "BD_GLOSSY", 1);
    if (g->blocks && g->inputs->vector) bd_define(&source.defines, "BD_VECTOR", 1);
    if (g->blocks && g->inputs->spread) bd_define(&source.defines, "BD_SPREAD", 1);
    bd_define(&estimate.defines, "BD_ESTIMATE", 1);
    struct bd_program *program = NULL, *estimate_program = NULL;
    enum bd_err err = bd_program_get(g->context->gpu, &source, &program, fault);
    if (!err) err = bd_program_get(g->context->gpu, &estimate, &estimate_program, fault);
    g->program = program;
    g->estimate_program = estimate_program;
    return err;
}

static double mean_irradiance(const struct bd_gather_tree_inputs *inputs)
{
    double flux = 0, radius = inputs->scene->space.radius;
    for (uint32_t i = 0; i < inputs->tree_count; i++) flux += inputs->trees[i]->flux;
    return flux / (4 * M_PI * radius * radius);
}

static struct gather_tree gather_tree_of(const struct bd_pass_context *context,
                                         const struct bd_gather_tree_inputs *inputs)
{
    return (struct gather_tree){
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
        .mean_irradiance = mean_irradiance(inputs),
    };
}

static enum bd_err run(struct gather_tree *g, struct bd_fault *fault)
{
    const size_t bytes = (receivers(g) + 1) * sizeof(uint32_t);
    enum bd_err err =
        bd_buf_create(g->context->gpu, "tree estimates", bytes, NULL, &g->estimates, fault);
    if (!err)
        err = bd_buf_create(g->context->gpu, "tree walks", bytes, NULL, &g->next_roots, fault);
    if (!err) err = get_programs(g, fault);
    if (!err) err = gather_all(g);
    bd_buf_destroy(g->context->gpu, &g->next_roots);
    bd_buf_destroy(g->context->gpu, &g->estimates);
    return err;
}

enum bd_err bd_gather_tree_run(const struct bd_pass_context *context,
                               const struct bd_gather_tree_inputs *inputs, struct bd_indirect **out,
                               struct bd_fault *fault)
{
    struct gather_tree g = gather_tree_of(context, inputs);
    g.row_count = g.view.size_px.y;
    g.row_width = g.view.size_px.x;
    enum bd_err err =
        bd_indirect_create(context->gpu, inputs->viewpoint, inputs->glossy, &g.pixels, fault);
    if (!err) err = run(&g, fault);
    if (err) {
        bd_indirect_destroy(context->gpu, &g.pixels);
        return err;
    }
    *out = g.pixels;
    return BD_ERR_OK;
}

enum bd_err bd_gather_tree_fragments_run(const struct bd_pass_context *context,
                                         const struct bd_gather_tree_inputs *inputs,
                                         struct bd_multires_light **out, struct bd_fault *fault)
{
    struct gather_tree g = gather_tree_of(context, inputs);
    g.row_count = (inputs->fragments->count + FRAGMENTS_PER_ROW - 1) / FRAGMENTS_PER_ROW;
    g.row_width = FRAGMENTS_PER_ROW;
    enum bd_err err = BD_ERR_OK;
    if (inputs->into)
        g.blocks = inputs->into;
    else
        err = bd_multires_light_create(context->gpu, &inputs->fragments->layout,
                                       inputs->vector ? BD_LIGHT_VECTORS_ALL
                                                      : BD_LIGHT_VECTORS_NONE,
                                       &g.blocks, fault);
    if (!err) err = run(&g, fault);
    if (err) {
        if (!inputs->into) bd_multires_light_destroy(context->gpu, &g.blocks);
        return err;
    }
    *out = g.blocks;
    return BD_ERR_OK;
}
