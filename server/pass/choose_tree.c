#include "pass/choose_tree.h"

#include <stdlib.h>

#include "base/assert.h"
#include "pass/kernels.h"
#include "pass/tree_walk.h"
#include "shared/bindings.h"

// A first guess at a receiver's two walks and its picks, in the slicer's units.
#define UNITS_PER_RECEIVER 4000.0
// Of shaders/common/tree_choice.glsl, beyond a sum for each light.
#define SUMS_BESIDE_LIGHTS 3u
// The software device ends all loops of eight invocations after 65,535 rounds in all. Each of them
// may come to its picks at other nodes; a pick climbs down to its leaf in a few rounds, and a near
// one's patch takes a dozen.
#define PICKS_PER_WALK     4096u
#define PICKS_PER_DISPATCH 1024u

struct bd_tree_choice {
    const struct bd_pass_context *context;
    const struct bd_gather_tree_inputs *inputs;
    uint32_t rays;
    struct bd_choice choice;
    const struct bd_program *estimate, *weigh, *choose, *pick;
    // While a slice is chosen for.
    struct bd_tree_walk walk;
    struct bd_asking *asking;
    size_t receivers;
    const struct bd_program *walks; // what is done at the walk's nodes
};

static void dispatch(struct bd_tree_choice *c, const char *pass, const struct bd_program *program,
                     const struct bd_tree_roots *roots)
{
    const struct bd_gather_tree_args args = bd_tree_walk_args(&c->walk, roots);
    bd_tree_walk_bind(&c->walk, roots, &args, &c->asking->bindings);
    c->asking->args.light_index = roots->light;
    bd_asking_set_maps(c->inputs->visibility, c->inputs->leaves[roots->light], c->asking);
    bd_gpu_pass_begin(c->context->gpu, pass);
    bd_askers_dispatch(c->context->gpu, program, c->asking);
    bd_gpu_pass_end(c->context->gpu);
}

static enum bd_err visit(void *user, const struct bd_tree_roots *roots)
{
    struct bd_tree_choice *c = user;
    const bool chooses = c->walks == c->choose;
    bd_slicer_work(c->context->slicer, roots->estimate ? "choose_tree estimate"
                                       : chooses       ? "choose_tree"
                                                       : "choose_tree weigh");
    dispatch(c, chooses ? "choose" : "weigh", roots->estimate ? c->estimate : c->walks, roots);
    const double units = roots->estimate ? roots->count : UNITS_PER_RECEIVER;
    return bd_slicer_checkpoint(c->context->slicer, units * (double)c->receivers);
}

static enum bd_err walk(struct bd_tree_choice *c, const struct bd_program *program)
{
    enum bd_err err = BD_ERR_OK;
    c->walks = program;
    for (uint32_t i = 0; !err && i < c->inputs->tree_count; i++)
        err = bd_tree_walk_light(c->context->gpu, &c->walk, i, visit, c);
    return err;
}

static void ask_for(struct bd_tree_choice *c, uint32_t first, uint32_t most)
{
    c->asking->args.first_item = first;
    c->asking->args.item_count = c->rays - first < most ? c->rays - first : most;
}

// Leaves for the nodes of a light that were chosen.
static enum bd_err pick(struct bd_tree_choice *c, uint32_t light)
{
    const struct bd_tree_roots roots = {.light = light};
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(c->context->slicer, "choose_tree pick");
    for (uint32_t at = 0; !err && at < c->rays; at += PICKS_PER_DISPATCH) {
        ask_for(c, at, PICKS_PER_DISPATCH);
        dispatch(c, "choose", c->pick, &roots);
        err = bd_slicer_checkpoint(c->context->slicer,
                                   (double)c->receivers * c->asking->args.item_count);
    }
    return err;
}

static enum bd_err choose_slice(struct bd_tree_choice *c)
{
    c->walks = c->weigh;
    enum bd_err err = bd_tree_walk_estimate(&c->walk, visit, c);
    if (!err) err = walk(c, c->weigh);
    for (uint32_t at = 0; !err && at < c->rays; at += PICKS_PER_WALK) {
        ask_for(c, at, PICKS_PER_WALK);
        err = walk(c, c->choose);
    }
    for (uint32_t i = 0; !err && i < c->inputs->tree_count; i++) err = pick(c, i);
    return err;
}

static enum bd_err run(void *user, const struct bd_askers_slice *slice, struct bd_asking *asking,
                       struct bd_err_detail *detail)
{
    struct bd_tree_choice *c = user;
    struct bd_gpu *gpu = c->context->gpu;
    c->asking = asking;
    c->receivers = slice->count;
    enum bd_err err = bd_tree_walk_begin(gpu, c->inputs, c->receivers, &c->walk, detail);
    if (!err) err = choose_slice(c);
    bd_tree_walk_end(gpu, &c->walk);
    return err;
}

static enum bd_err get_programs(struct bd_tree_choice *c, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = c->context->gpu;
    struct bd_defines defines = {0}, weigh;
    const bool printed = c->inputs->criterion == BD_TREE_PRINTED;
    bd_define(&defines, "BD_FRAGMENTS", 1);
    if (c->inputs->vector) bd_define(&defines, "BD_VECTOR", 1);
    if (printed) bd_define(&defines, "BD_PRINTED", 1);
    if (c->inputs->near_patches && !printed) bd_define(&defines, "BD_VPL_PATCH", 1);
    weigh = defines;
    if (c->inputs->spread) bd_define(&weigh, "BD_SPREAD", 1);
    enum bd_err err =
        bd_compute_get(gpu, "pass/choose_tree/estimate.comp", &defines, &c->estimate, detail);
    if (!err) err = bd_compute_get(gpu, "pass/choose_tree/weigh.comp", &weigh, &c->weigh, detail);
    if (!err)
        err = bd_compute_get(gpu, "pass/choose_tree/choose.comp", &defines, &c->choose, detail);
    return err ? err
               : bd_compute_get(gpu, "pass/choose_tree/pick.comp", &defines, &c->pick, detail);
}

enum bd_err bd_tree_choice_create(const struct bd_pass_context *context,
                                  const struct bd_gather_tree_inputs *inputs, uint32_t rays,
                                  struct bd_tree_choice **out, struct bd_err_detail *detail)
{
    struct bd_tree_choice *c = *out = calloc(1, sizeof *c);
    BD_ASSERT(c);
    c->context = context;
    c->inputs = inputs;
    c->rays = rays;
    c->choice = (struct bd_choice){inputs->tree_count + SUMS_BESIDE_LIGHTS, inputs->tree_count,
                                   UNITS_PER_RECEIVER, run, c};
    enum bd_err err = get_programs(c, detail);
    if (err) bd_tree_choice_destroy(out);
    return err;
}

void bd_tree_choice_destroy(struct bd_tree_choice **choice)
{
    free(*choice);
    *choice = NULL;
}

const struct bd_choice *bd_tree_choice_get(const struct bd_tree_choice *choice)
{
    return &choice->choice;
}
