#include "pass/vpl_tree.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "pass/native_lists.h"
#include "shared/bindings.h"
#include "shared/types.h"
#include "shared/vpl.h"
#include "shared/vpl_tree.h"

// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_NODE  100.0
#define NODES_PER_GROUP 64u
#define GROUPS_MAX      65535u // of one dispatch

#define UNITS_PER_NATIVE_NODE 4.0 // as it makes them, a fifth of a microsecond

static bool is_power_of_two(uint32_t n)
{
    return n > 0 && (n & (n - 1)) == 0;
}

// Nodes of level `level` in a face.
static uint32_t level_nodes(const struct bd_vpl_tree *tree, uint32_t level)
{
    return (tree->root_side << level) * (tree->root_side << level);
}

uint32_t bd_vpl_tree_level_first(const struct bd_vpl_tree *tree, uint32_t level)
{
    return (level_nodes(tree, level) - level_nodes(tree, 0)) / 3;
}

uint32_t bd_vpl_tree_level_count(const struct bd_vpl_tree *tree)
{
    uint32_t count = 1;
    while (tree->root_side << (count - 1) < tree->leaf_side) count++;
    return count;
}

static uint32_t face_nodes(const struct bd_vpl_tree *tree)
{
    return bd_vpl_tree_level_first(tree, bd_vpl_tree_level_count(tree));
}

// --- the light ------------------------------------------------------------------------------

static double solid_angle_sr(double half_width, double half_height)
{
    double w2 = half_width * half_width, h2 = half_height * half_height;
    return 4 * asin(half_width * half_height / sqrt((1 + w2) * (1 + h2)));
}

static void describe_surfaces(struct bd_vpl_tree *tree, double area, double flux)
{
    tree->face_extent = area;
    tree->flux = flux;
    tree->intensity = area > 0 ? flux / area : 0;
}

static void describe_light(struct bd_vpl_tree *tree, const struct bd_vpl_tree_inputs *inputs)
{
    const struct bd_light_setup *setup = inputs->light;
    if (!setup) {
        describe_surfaces(tree, inputs->area, inputs->flux);
        return;
    }
    const struct bd_light *light = setup->light;
    const struct bd_render_space *space = inputs->space;
    const double per_m2 = space->render_per_m * space->render_per_m;
    const double strongest = fmax(light->color[0], fmax(light->color[1], light->color[2]));
    const bool directional = light->kind == BD_LIGHT_DIRECTIONAL;
    tree->face_extent = directional ? 4 * setup->half_width * setup->half_height * per_m2
                                    : solid_angle_sr(setup->half_width, setup->half_height);
    tree->intensity = strongest * (directional ? light->intensity / space->unit_cd_m2
                                               : bd_render_intensity(space, light->intensity));
    tree->flux = tree->intensity *
                 (directional ? tree->face_extent : bd_light_effective_solid_angle_sr(light));
}

static bool is_far(const struct bd_vpl_tree_inputs *inputs)
{
    return !inputs->light || inputs->light->light->kind == BD_LIGHT_DIRECTIONAL;
}

static struct bd_light_uniform light_uniform(const struct bd_vpl_tree_inputs *inputs)
{
    if (inputs->light) return bd_light_setup_uniform(inputs->light, inputs->space, 0);
    return (struct bd_light_uniform){.kind = BD_LIGHT_KIND_DIRECTIONAL};
}

// --- on the device ------------------------------------------------------------------------------

static void dispatch(const struct bd_pass_context *context, const struct bd_vpl_tree_inputs *inputs,
                     const struct bd_program *program, const struct bd_vpl_tree *tree,
                     uint32_t level, uint32_t first, uint32_t count)
{
    const struct bd_vpl_tree_args args = {
        .level_node_count = level_nodes(tree, level),
        .level_first_node = bd_vpl_tree_level_first(tree, level),
        .face_node_count = face_nodes(tree),
        .has_leaves = level + 1 == bd_vpl_tree_level_count(tree),
        .face_count = tree->face_count,
        .leaf_side = tree->leaf_side,
        .first_node = first,
        .node_count = count,
    };
    const struct bd_light_uniform light = light_uniform(inputs);
    struct bd_bindings bindings = {0};
    bindings.arrays[BD_UNIT_VPLS] = inputs->leaves->vpls;
    bindings.arrays[BD_UNIT_VPL_QUADS] = inputs->leaves->quads;
    bindings.storage[BD_STORAGE_TREE_NODES].buf = tree->nodes;
    bindings.storage[BD_STORAGE_TREE_NODES].read = true;
    bindings.storage[BD_STORAGE_TREE_NODES].write = true;
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
    bindings.uniforms[BD_UNIFORM_LIGHT].bytes = &light;
    bindings.uniforms[BD_UNIFORM_LIGHT].size_bytes = sizeof light;
    uint32_t group[3];
    bd_program_group_size(program, group);
    bd_gpu_dispatch(context->gpu, program, &bindings, (count + group[0] - 1) / group[0],
                    tree->face_count, 1);
}

// Nodes of all faces side by side.
static enum bd_err build_level(const struct bd_pass_context *context,
                               const struct bd_vpl_tree_inputs *inputs,
                               const struct bd_program *program, const struct bd_vpl_tree *tree,
                               uint32_t level)
{
    const uint32_t nodes = level_nodes(tree, level);
    const double units = UNITS_PER_NODE * tree->face_count * NODES_PER_GROUP;
    for (uint32_t first = 0; first < nodes;) {
        uint32_t groups = bd_slicer_rows(context->slicer, units,
                                         (nodes - first + NODES_PER_GROUP - 1) / NODES_PER_GROUP);
        if (groups > GROUPS_MAX) groups = GROUPS_MAX;
        uint32_t most = groups * NODES_PER_GROUP, left = nodes - first;
        uint32_t count = left < most ? left : most;
        dispatch(context, inputs, program, tree, level, first, count);
        enum bd_err err = bd_slicer_checkpoint(context->slicer, units * groups);
        if (err) return err;
        first += count;
    }
    return BD_ERR_OK;
}

static enum bd_err build_on_device(const struct bd_pass_context *context,
                                   const struct bd_vpl_tree_inputs *inputs,
                                   const struct bd_vpl_tree *tree, struct bd_err_detail *detail)
{
    const struct bd_program_source source = {.compute = "pass/vpl_tree/vpl_tree.comp"};
    struct bd_program *program;
    enum bd_err err = bd_program_get(context->gpu, &source, &program, detail);
    if (err) return err;
    bd_slicer_work(context->slicer, "vpl_tree");
    for (uint32_t level = bd_vpl_tree_level_count(tree); !err && level-- > 0;)
        err = build_level(context, inputs, program, tree, level);
    return err;
}

// --- by the processor ---------------------------------------------------------------------------

// A level, in groups of BD_LANES nodes of one face.
struct level {
    const struct bd_native_loops *loops;
    const struct bd_vpl_tree *tree;
    struct bd_vec4 *nodes;
    struct bd_native_leaves leaves; // of all faces
    uint32_t level, face_groups;
};

static void build_group(void *user, uint32_t group)
{
    const struct level *l = user;
    const uint32_t face = group / l->face_groups, first = group % l->face_groups * BD_LANES;
    const uint32_t count = level_nodes(l->tree, l->level);
    const uint32_t left = count - first, lanes = left < BD_LANES ? left : BD_LANES;
    struct bd_vec4 *face_at = l->nodes + (size_t)face * face_nodes(l->tree) * BD_TREE_NODE_VEC4S;
    struct bd_vec4 *at =
        face_at + (bd_vpl_tree_level_first(l->tree, l->level) + (size_t)first) * BD_TREE_NODE_VEC4S;
    if (l->level + 1 < bd_vpl_tree_level_count(l->tree)) {
        const size_t below = bd_vpl_tree_level_first(l->tree, l->level + 1) + (size_t)first * 4;
        l->loops->join_nodes(face_at + below * BD_TREE_NODE_VEC4S, lanes, at);
        return;
    }
    struct bd_native_leaves leaves = l->leaves;
    leaves.vpls += (size_t)face * count * BD_VPL_VEC4S;
    leaves.quads += (size_t)face * count * BD_VPL_QUAD_VEC4S;
    leaves.first = first;
    leaves.count = lanes;
    l->loops->make_leaves(&leaves, at);
}

static enum bd_err build_levels(const struct bd_pass_context *context,
                                const struct bd_vpl_tree_inputs *inputs,
                                const struct bd_vpl_tree *tree, const struct bd_native_vpls *vpls,
                                struct bd_vec4 *nodes)
{
    const struct bd_light_uniform light = light_uniform(inputs);
    struct level level = {
        .loops = context->processor->loops,
        .tree = tree,
        .nodes = nodes,
        .leaves = {.vpls = vpls->vpls,
                   .quads = vpls->quads,
                   .side = tree->leaf_side,
                   .light = light.position,
                   .directional = is_far(inputs)},
        .level = bd_vpl_tree_level_count(tree),
    };
    enum bd_err err = BD_ERR_OK;
    bd_slicer_work(context->slicer, "native vpl_tree");
    while (!err && level.level-- > 0) {
        level.face_groups = (level_nodes(tree, level.level) + BD_LANES - 1) / BD_LANES;
        err = bd_receivers_each(context, level.face_groups * tree->face_count,
                                UNITS_PER_NATIVE_NODE * BD_LANES, build_group, &level);
    }
    return err;
}

static enum bd_err build_native(const struct bd_pass_context *context,
                                const struct bd_vpl_tree_inputs *inputs,
                                const struct bd_vpl_tree *tree, struct bd_err_detail *detail)
{
    struct bd_gpu *gpu = context->gpu;
    struct bd_native_vpls *vpls = NULL;
    void *nodes = NULL;
    enum bd_err err = bd_native_lists_borrow(gpu, &inputs->leaves, 1, &vpls, detail);
    if (!err) err = bd_buf_borrow(gpu, tree->nodes, BD_BORROW_TO_WRITE, &nodes, detail);
    if (!err) err = build_levels(context, inputs, tree, vpls, nodes);
    bd_buf_return(gpu, tree->nodes, BD_BORROW_TO_WRITE, &nodes);
    bd_native_lists_return(gpu, &inputs->leaves, 1, &vpls);
    return err;
}

// --- all ----------------------------------------------------------------------------------------

static enum bd_err build(const struct bd_pass_context *context,
                         const struct bd_vpl_tree_inputs *inputs, struct bd_vpl_tree *tree,
                         struct bd_err_detail *detail)
{
    const size_t bytes =
        (size_t)face_nodes(tree) * tree->face_count * BD_TREE_NODE_VEC4S * sizeof(struct bd_vec4);
    enum bd_err err = bd_buf_create_unset(context->gpu, "vpl tree", bytes, &tree->nodes, detail);
    if (err) return err;
    return context->processor ? build_native(context, inputs, tree, detail)
                              : build_on_device(context, inputs, tree, detail);
}

enum bd_err bd_vpl_tree_run(const struct bd_pass_context *context,
                            const struct bd_vpl_tree_inputs *inputs, struct bd_vpl_tree **out,
                            struct bd_err_detail *detail)
{
    const uint64_t leaf_count =
        (uint64_t)inputs->leaf_side * inputs->leaf_side * inputs->face_count;
    BD_ASSERT(is_power_of_two(inputs->root_side) && is_power_of_two(inputs->leaf_side));
    BD_ASSERT_CMP(inputs->root_side, <=, inputs->leaf_side);
    BD_ASSERT_CMP(leaf_count, ==, inputs->leaves->count);
    struct bd_vpl_tree *tree = calloc(1, sizeof *tree);
    BD_ASSERT(tree);
    tree->face_count = inputs->face_count;
    tree->root_side = inputs->root_side;
    tree->leaf_side = inputs->leaf_side;
    describe_light(tree, inputs);
    enum bd_err err = build(context, inputs, tree, detail);
    if (err) {
        bd_vpl_tree_destroy(context->gpu, &tree);
        return err;
    }
    *out = tree;
    return BD_ERR_OK;
}

void bd_vpl_tree_destroy(struct bd_gpu *gpu, struct bd_vpl_tree **tree)
{
    if (!*tree) return;
    bd_buf_destroy(gpu, &(*tree)->nodes);
    free(*tree);
    *tree = NULL;
}

uint64_t bd_vpl_tree_bytes(const struct bd_vpl_tree *tree)
{
    return bd_buf_size_bytes(tree->nodes);
}
