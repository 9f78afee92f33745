#include "pass/gather_tree.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/clock.h"
#include "shared/bindings.h"
#include "shared/gather_tree.h"

_Static_assert(BD_TREE_LIGHTCUTS == BD_TREE_CRITERION_LIGHTCUTS, "C and GLSL agree");
_Static_assert(BD_TREE_BOUND == BD_TREE_CRITERION_BOUND, "C and GLSL agree");
_Static_assert(BD_TREE_LEVEL == BD_TREE_CRITERION_LEVEL, "C and GLSL agree");
_Static_assert(BD_TREE_PRINTED == BD_TREE_CRITERION_PRINTED, "C and GLSL agree");

// Leaves under the roots of a dispatch: a fixed number, because it sets the order of the sums. Each
// costs an invocation up to four rounds of its loops.
#define LEAVES_PER_DISPATCH (BD_TREE_ROOT_LEAVES_MAX * BD_TREE_ROOT_LEAVES_MAX)
// A first guess at a receiver's cut, in the slicer's units; then each slice teaches the next.
#define UNITS_PER_RECEIVER 2000.0
#define LEARNING_MS_MIN    1.0

struct gather_tree {
    const struct bd_pass_context *context;
    const struct bd_gather_tree_inputs *inputs;
    const struct bd_program *program, *estimate_program;
    struct bd_view view;
    double mean_irradiance; // of the frame
    double units_per_receiver;
    struct bd_buf *estimates;
    struct bd_indirect *out;
};

static void dispatch(const struct gather_tree *g, uint32_t light, bool estimate,
                     const struct bd_gather_tree_args *args)
{
    const struct bd_program *program = estimate ? g->estimate_program : g->program;
    struct bd_bindings bindings = {0};
    bd_gbuffer_bind(g->inputs->gbuffer, &bindings);
    bindings.arrays[BD_UNIT_VPLS] = g->inputs->leaves[light]->vpls;
    bindings.arrays[BD_UNIT_VPL_QUADS] = g->inputs->leaves[light]->quads;
    bindings.arrays[BD_UNIT_TREE_NODES] = g->inputs->trees[light]->nodes;
    bindings.storage[BD_STORAGE_ESTIMATES].buf = g->estimates;
    bindings.storage[BD_STORAGE_ESTIMATES].read = true;
    bindings.storage[BD_STORAGE_ESTIMATES].write = true;
    if (!estimate) {
        bindings.images[0].tex = g->out->irradiance;
        bindings.images[0].read = bindings.images[0].write = true;
        bindings.images[1].tex = g->out->glossy;
        bindings.images[1].read = bindings.images[1].write = g->out->glossy != NULL;
    }
    bindings.uniforms[BD_UNIFORM_VIEW].bytes = &g->view;
    bindings.uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof g->view;
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof *args;
    uint32_t group[3];
    bd_program_group_size(program, group);
    bd_gpu_dispatch(g->context->gpu, program, &bindings,
                    (g->view.size_px.x + group[0] - 1) / group[0],
                    (args->rows.y + group[1] - 1) / group[1], 1);
}

// What a receiver's cut costs is not known before: the next slice is as long as this one says.
static enum bd_err end_slice(struct gather_tree *g, double receivers)
{
    struct bd_slicer *slicer = g->context->slicer;
    uint64_t start_ns = bd_clock_ns();
    enum bd_err err = bd_slicer_checkpoint(slicer, 0);
    double ms = bd_ms_since(start_ns);
    if (ms > LEARNING_MS_MIN) g->units_per_receiver = ms * slicer->units_per_ms / receivers;
    return err;
}

static struct bd_gather_tree_args args_of(const struct gather_tree *g, uint32_t light,
                                          uint32_t first_root, uint32_t root_count, bool first)
{
    const struct bd_vpl_tree *tree = g->inputs->trees[light];
    const double per_m2 = pow(g->inputs->scene->space.render_per_m, -2);
    return (struct bd_gather_tree_args){
        .rows = {0, 0, first, 0},
        .tree = {first_root, root_count, tree->root_side, bd_vpl_tree_level_count(tree)},
        .cut = {(uint32_t)g->inputs->criterion, 0, 0, 0},
        .tau = {(float)g->inputs->tau, (float)(g->inputs->tau * g->mean_irradiance),
                (float)(BD_TREE_ESTIMATE_MIN * g->mean_irradiance), 0},
        .light = {(float)(tree->intensity * tree->face_extent), (float)tree->face_extent,
                  (float)per_m2, 0},
    };
}

static enum bd_err gather_roots(struct gather_tree *g, uint32_t light, bool estimate,
                                uint32_t first_root, uint32_t root_count, bool first)
{
    const uint32_t width = g->view.size_px.x, height = g->view.size_px.y;
    struct bd_gather_tree_args args = args_of(g, light, first_root, root_count, first);
    for (uint32_t row = 0; row < height;) {
        double units_per_row =
            estimate ? (double)width * root_count : width * g->units_per_receiver;
        uint32_t rows = bd_slicer_rows(g->context->slicer, units_per_row, height - row);
        args.rows.x = row;
        args.rows.y = rows;
        dispatch(g, light, estimate, &args);
        enum bd_err err = estimate ? bd_slicer_checkpoint(g->context->slicer, 0)
                                   : end_slice(g, (double)width * rows);
        if (err) return err;
        row += rows;
    }
    return BD_ERR_OK;
}

static enum bd_err gather_tree(struct gather_tree *g, uint32_t light, bool estimate, bool *first)
{
    const struct bd_vpl_tree *tree = g->inputs->trees[light];
    const uint32_t root_leaves = tree->leaf_side / tree->root_side;
    const uint32_t roots = tree->root_side * tree->root_side * tree->face_count;
    BD_ASSERT_CMP(root_leaves, <=, BD_TREE_ROOT_LEAVES_MAX);
    const uint32_t step = LEAVES_PER_DISPATCH / (estimate ? 1 : root_leaves * root_leaves);
    for (uint32_t root = 0; root < roots; root += step) {
        uint32_t left = roots - root;
        enum bd_err err = gather_roots(g, light, estimate, root, left < step ? left : step, *first);
        if (err) return err;
        *first = false;
    }
    return BD_ERR_OK;
}

static enum bd_err gather_all(struct gather_tree *g)
{
    bool first = true;
    enum bd_err err = BD_ERR_OK;
    if (g->inputs->criterion == BD_TREE_LIGHTCUTS)
        for (uint32_t i = 0; !err && i < g->inputs->tree_count; i++)
            err = gather_tree(g, i, true, &first);
    first = true;
    for (uint32_t i = 0; !err && i < g->inputs->tree_count; i++)
        err = gather_tree(g, i, false, &first);
    return err;
}

static enum bd_err get_programs(struct gather_tree *g, struct bd_fault *fault)
{
    struct bd_program_source source = {.compute = "pass/gather_tree/gather_tree.comp"};
    struct bd_program_source estimate = source;
    if (g->inputs->near_patches) bd_define(&source.defines, "BD_VPL_PATCH", 1);
    if (g->inputs->glossy) bd_define(&source.defines, "BD_GLOSSY", 1);
    bd_define(&estimate.defines, "BD_ESTIMATE", 1);
    struct bd_program *program = NULL, *estimate_program = NULL;
    enum bd_err err = bd_program_get(g->context->gpu, &source, &program, fault);
    if (!err) err = bd_program_get(g->context->gpu, &estimate, &estimate_program, fault);
    g->program = program;
    g->estimate_program = estimate_program;
    return err;
}

static enum bd_err create_outputs(struct gather_tree *g, struct bd_fault *fault)
{
    struct bd_gpu *gpu = g->context->gpu;
    const struct bd_viewpoint *viewpoint = g->inputs->viewpoint;
    size_t pixels = (size_t)viewpoint->width_px * viewpoint->height_px;
    enum bd_err err =
        bd_buf_create(gpu, "tree estimates", pixels * sizeof(float), NULL, &g->estimates, fault);
    return err ? err : bd_indirect_create(gpu, viewpoint, g->inputs->glossy, &g->out, fault);
}

static double mean_irradiance(const struct bd_gather_tree_inputs *inputs)
{
    double flux = 0, radius = inputs->scene->space.radius;
    for (uint32_t i = 0; i < inputs->tree_count; i++) flux += inputs->trees[i]->flux;
    return flux / (4 * M_PI * radius * radius);
}

enum bd_err bd_gather_tree_run(const struct bd_pass_context *context,
                               const struct bd_gather_tree_inputs *inputs, struct bd_indirect **out,
                               struct bd_fault *fault)
{
    struct gather_tree g = {
        .context = context,
        .inputs = inputs,
        .view = bd_viewpoint_uniform(inputs->viewpoint, &inputs->scene->space),
        .mean_irradiance = mean_irradiance(inputs),
        .units_per_receiver = UNITS_PER_RECEIVER,
    };
    enum bd_err err = create_outputs(&g, fault);
    if (!err) err = get_programs(&g, fault);
    if (!err) err = gather_all(&g);
    bd_buf_destroy(context->gpu, &g.estimates);
    if (err) {
        bd_indirect_destroy(context->gpu, &g.out);
        return err;
    }
    *out = g.out;
    return BD_ERR_OK;
}
