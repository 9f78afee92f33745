// Light of cuts of the tree of virtual lights, on the processor.

#include "pass/gather_native.h"

#include <stdlib.h>

#include "base/assert.h"
#include "pass/native_lists.h"
#include "pass/tree_walk.h"

// A first guess at a root's part of a cut, in the slicer's units; then each slice teaches the next.
#define UNITS_PER_ROOT 4.0

struct gather {
    const struct bd_pass_context *context;
    struct bd_tree_walk walk;
    struct bd_native_wishes wishes;
    struct bd_native_vpls *leaves;
    struct bd_native_tree *trees;
    const struct bd_receiver_part *part;
    uint32_t (*steps)[BD_LANES]; // of each group of the part
    const struct bd_native_tree *turn;
};

// --- what it works on ---------------------------------------------------------------------------

static enum bd_err borrow_trees(struct gather *g, struct bd_err_detail *detail)
{
    const struct bd_gather_tree_inputs *in = g->walk.inputs;
    g->trees = calloc(in->tree_count + 1, sizeof *g->trees);
    BD_ASSERT(g->trees);
    struct bd_gpu *gpu = g->context->gpu;
    enum bd_err err = bd_native_lists_borrow(gpu, in->leaves, in->tree_count, &g->leaves, detail);
    for (uint32_t i = 0; !err && i < in->tree_count; i++) {
        const struct bd_tree_roots all = {.light = i, .count = bd_tree_root_count(in->trees[i])};
        void *nodes = NULL;
        err = bd_buf_borrow(gpu, in->trees[i]->nodes, BD_BORROW_TO_READ, &nodes, detail);
        g->trees[i] = (struct bd_native_tree){
            .nodes = nodes, .leaves = g->leaves[i], .args = bd_tree_walk_args(&g->walk, &all)};
    }
    return err;
}

static void return_trees(struct gather *g)
{
    const struct bd_gather_tree_inputs *in = g->walk.inputs;
    for (uint32_t i = 0; g->trees && i < in->tree_count; i++) {
        void *nodes = (void *)g->trees[i].nodes;
        bd_buf_return(g->context->gpu, in->trees[i]->nodes, BD_BORROW_TO_READ, &nodes);
    }
    bd_native_lists_return(g->context->gpu, in->leaves, in->tree_count, &g->leaves);
    free(g->trees);
    free(g->steps);
}

// --- a part -------------------------------------------------------------------------------------

static void estimate_group(void *user, uint32_t group)
{
    const struct gather *g = user;
    g->context->processor->loops->estimate(&g->part->receivers[group], g->turn, g->steps[group]);
}

static void gather_group(void *user, uint32_t group)
{
    const struct gather *g = user;
    g->context->processor->loops->gather_tree(&g->part->receivers[group], g->turn, &g->wishes,
                                              g->steps[group], &g->part->light[group]);
}

static enum bd_err estimate(struct gather *g)
{
    enum bd_err err = BD_ERR_OK;
    if (g->walk.inputs->criterion != BD_TREE_LIGHTCUTS) return err;
    bd_slicer_work(g->context->slicer, "native estimate");
    for (uint32_t i = 0; !err && i < g->walk.inputs->tree_count; i++) {
        g->turn = &g->trees[i];
        err = bd_receivers_each(g->context, g->part->group_count,
                                (double)g->trees[i].args.root_count * BD_LANES, estimate_group, g);
    }
    return err;
}

// So many roots in a turn that their nodes are no more than a turn's, at least one.
static uint32_t roots_of_turn(const struct bd_native_tree *tree)
{
    const uint32_t nodes_of_root = tree->args.nodes_per_root;
    return nodes_of_root < BD_TURN_EVALUATIONS ? BD_TURN_EVALUATIONS / nodes_of_root : 1;
}

static enum bd_err gather_tree(struct gather *g, const struct bd_native_tree *tree)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t root = 0; !err && root < tree->args.root_count; root += roots_of_turn(tree)) {
        struct bd_native_tree turn = *tree;
        const uint32_t left = tree->args.root_count - root;
        turn.args.first_root = root;
        turn.args.root_count = left < roots_of_turn(tree) ? left : roots_of_turn(tree);
        g->turn = &turn;
        err = bd_receivers_each(g->context, g->part->group_count,
                                UNITS_PER_ROOT * turn.args.root_count * BD_LANES, gather_group, g);
    }
    return err;
}

static enum bd_err light_part(void *user, const struct bd_receiver_part *part)
{
    struct gather *g = user;
    g->part = part;
    free(g->steps);
    g->steps = calloc(part->group_count, sizeof *g->steps);
    BD_ASSERT(g->steps);
    enum bd_err err = estimate(g);
    bd_slicer_work(g->context->slicer, "native gather_tree");
    for (uint32_t i = 0; !err && i < g->walk.inputs->tree_count; i++)
        err = gather_tree(g, &g->trees[i]);
    return err;
}

enum bd_err bd_gather_tree_native_run(const struct bd_pass_context *context,
                                      const struct bd_receivers_inputs *receivers,
                                      const struct bd_gather_tree_inputs *inputs,
                                      struct bd_err_detail *detail)
{
    struct gather g = {
        .context = context,
        .walk = bd_tree_walk_of(inputs),
        .wishes = bd_native_wishes_of(receivers),
    };
    struct bd_receivers_inputs own = *receivers;
    own.light = light_part;
    own.user = &g;
    enum bd_err err = borrow_trees(&g, detail);
    if (!err) err = bd_receivers_run(context, &own, detail);
    return_trees(&g);
    return err;
}
