#include "pass/tree_walk.h"

#include <math.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "shared/bindings.h"

_Static_assert(BD_TREE_LIGHTCUTS == BD_TREE_CRITERION_LIGHTCUTS, "C and GLSL agree");
_Static_assert(BD_TREE_BOUND == BD_TREE_CRITERION_BOUND, "C and GLSL agree");
_Static_assert(BD_TREE_LEVEL == BD_TREE_CRITERION_LEVEL, "C and GLSL agree");
_Static_assert(BD_TREE_PRINTED == BD_TREE_CRITERION_PRINTED, "C and GLSL agree");

// Nodes that a receiver visits in a round, at most: all of the largest root. A fixed number,
// because it sets the order of the sums. A leaf costs an invocation a dozen rounds of its loops if
// it is near. A receiver keeps where it is and goes as far as it may: one dispatch, unless tau is
// next to nothing. A few roots a dispatch would read each receiver's surface again for each.
#define LEAVES_PER_ROUND (BD_TREE_ROOT_LEAVES_MAX * BD_TREE_ROOT_LEAVES_MAX)
#define NODES_PER_ROUND  ((4 * LEAVES_PER_ROUND - 1) / 3)
#define ESTIMATE_STEPS   65536.0 // of the frame's mean irradiance

static double mean_irradiance(const struct bd_gather_tree_inputs *inputs)
{
    double flux = 0, radius = inputs->scene->space.radius;
    for (uint32_t i = 0; i < inputs->tree_count; i++) flux += inputs->trees[i]->flux;
    return flux / (4 * M_PI * radius * radius);
}

struct bd_tree_walk bd_tree_walk_of(const struct bd_gather_tree_inputs *inputs)
{
    return (struct bd_tree_walk){.inputs = inputs, .mean_irradiance = mean_irradiance(inputs)};
}

enum bd_err bd_tree_walk_begin(struct bd_gpu *gpu, const struct bd_gather_tree_inputs *inputs,
                               size_t receivers, struct bd_tree_walk *out,
                               struct bd_err_detail *detail)
{
    const size_t bytes = (receivers + 1) * sizeof(uint32_t);
    *out = bd_tree_walk_of(inputs);
    enum bd_err err = bd_buf_create(gpu, "tree estimates", bytes, NULL, &out->estimates, detail);
    if (!err) err = bd_buf_create(gpu, "tree walks", bytes, NULL, &out->next_roots, detail);
    if (err) bd_tree_walk_end(gpu, out);
    return err;
}

void bd_tree_walk_end(struct bd_gpu *gpu, struct bd_tree_walk *walk)
{
    bd_buf_destroy(gpu, &walk->next_roots);
    bd_buf_destroy(gpu, &walk->estimates);
}

struct bd_gather_tree_args bd_tree_walk_args(const struct bd_tree_walk *walk,
                                             const struct bd_tree_roots *roots)
{
    const struct bd_gather_tree_inputs *in = walk->inputs;
    const struct bd_vpl_tree *tree = in->trees[roots->light];
    const uint32_t root_leaves = tree->leaf_side / tree->root_side;
    const double per_m2 = pow(in->scene->space.render_per_m, -2);
    return (struct bd_gather_tree_args){
        .is_first = roots->anew,
        .is_resumed = roots->goes_on,
        .first_root = roots->first,
        .root_count = roots->count,
        .root_side = tree->root_side,
        .level_count = bd_vpl_tree_level_count(tree),
        .criterion = (uint32_t)in->criterion,
        .nodes_per_round = NODES_PER_ROUND,
        .nodes_per_root = (4 * root_leaves * root_leaves - 1) / 3,
        .round = walk->round,
        .tau_relative = (float)in->tau,
        .tau_absolute = (float)(in->tau * walk->mean_irradiance),
        .estimate_min = (float)(BD_TREE_ESTIMATE_MIN * walk->mean_irradiance),
        .steps_per_unit = (float)(ESTIMATE_STEPS / walk->mean_irradiance),
        .face_flux = (float)(tree->intensity * tree->face_extent),
        .face_extent = (float)tree->face_extent,
        .per_m2 = (float)per_m2,
        .finest_level = in->finest_level,
    };
}

void bd_tree_walk_bind(const struct bd_tree_walk *walk, const struct bd_tree_roots *roots,
                       const struct bd_gather_tree_args *args, struct bd_bindings *bindings)
{
    const struct bd_gather_tree_inputs *in = walk->inputs;
    bindings->uniforms[BD_UNIFORM_TREE].bytes = args;
    bindings->uniforms[BD_UNIFORM_TREE].size_bytes = sizeof *args;
    bindings->arrays[BD_UNIT_VPLS] = in->leaves[roots->light]->vpls;
    bindings->arrays[BD_UNIT_VPL_QUADS] = in->leaves[roots->light]->quads;
    bindings->arrays[BD_UNIT_TREE_NODES] = in->trees[roots->light]->nodes;
    bd_bind_storage(bindings, BD_STORAGE_ESTIMATES, walk->estimates, true, roots->estimate);
    bd_bind_storage(bindings, BD_STORAGE_NEXT_ROOTS, walk->next_roots, true, !roots->estimate);
}

uint32_t bd_tree_root_count(const struct bd_vpl_tree *tree)
{
    return tree->root_side * tree->root_side * tree->face_count;
}

static enum bd_err estimate(struct bd_tree_walk *walk, uint32_t light, bd_tree_roots_fn *visit,
                            void *user)
{
    struct bd_tree_roots roots = {.light = light, .estimate = true};
    for (const uint32_t end = bd_tree_root_count(walk->inputs->trees[light]); roots.first < end;) {
        roots.count = end - roots.first < LEAVES_PER_ROUND ? end - roots.first : LEAVES_PER_ROUND;
        roots.anew = light == 0 && roots.first == 0;
        enum bd_err err = visit(user, &roots);
        if (err) return err;
        roots.first += roots.count;
    }
    return BD_ERR_OK;
}

enum bd_err bd_tree_walk_estimate(struct bd_tree_walk *walk, bd_tree_roots_fn *visit, void *user)
{
    enum bd_err err = BD_ERR_OK;
    if (walk->inputs->criterion != BD_TREE_LIGHTCUTS) return err;
    for (uint32_t i = 0; !err && i < walk->inputs->tree_count; i++)
        err = estimate(walk, i, visit, user);
    return err;
}

enum bd_err bd_tree_walk_light(struct bd_gpu *gpu, struct bd_tree_walk *walk, uint32_t light,
                               bd_tree_roots_fn *visit, void *user)
{
    const struct bd_vpl_tree *tree = walk->inputs->trees[light];
    struct bd_tree_roots roots = {
        .light = light, .count = bd_tree_root_count(tree), .anew = light == 0};
    BD_ASSERT_CMP(tree->leaf_side / tree->root_side, <=, BD_TREE_ROOT_LEAVES_MAX);
    uint32_t unfinished = 0;
    do {
        walk->round++;
        enum bd_err err = visit(user, &roots);
        if (!err) err = bd_buf_read(gpu, walk->next_roots, 0, &unfinished, sizeof unfinished);
        if (err) return err;
        roots.goes_on = true;
        roots.anew = false;
    } while (unfinished == walk->round);
    return BD_ERR_OK;
}
