// Light over cuts of a tree of VPLs at a group of receivers, as shaders/pass/gather_tree sums it.
// The lanes of a group go through the tree together: a node is looked at where one of them does, by
// the chunks of lanes that have such a one, and each lane takes it, or looks further down, for
// itself.

#include "pass/native/loops.h"

#include <string.h>

#include "base/assert.h"
#include "kernel/light_spread.h"
#include "kernel/morton.h"
#include "kernel/vpl_tree.h"
#include "pass/native/sums.h"
#include "shared/vpl_tree.h"

#define CHUNK      16u // lanes: one vector of the widest
#define CHUNKS     (BD_LANES / CHUNK)
#define LEVELS_MAX 8u // of a root: 64 leaves along a side

// Of the chunk that begins at lane `first`.
#define CHUNK_LANES(i) for (size_t lane_ = 0, i = first; lane_ < CHUNK; i = first + ++lane_)

// A place in the tree.
struct place {
    uint32_t root, level, morton;
};

// Lanes on their way through the tree.
struct walk {
    const struct bd_receivers *receivers;
    const struct bd_native_tree *tree;
    bool chunks[LEVELS_MAX + 1][CHUNKS];   // that look at the nodes of a level,
    uint32_t active[LEVELS_MAX][BD_LANES]; // and their lanes
    float estimate[BD_LANES];
    float least[BD_LANES], most[BD_LANES], r2[BD_LANES]; // of the node
    uint32_t refine[BD_LANES], lit[BD_LANES], near[BD_LANES];
    struct pairs pairs;
    struct bd_receiver_light sums;
};

// --- nodes --------------------------------------------------------------------------------------

static uint32_t roots_of_face(const struct bd_native_tree *tree)
{
    return tree->args.root_side * tree->args.root_side;
}

static uint32_t level_first(const struct bd_native_tree *tree, uint32_t level)
{
    return roots_of_face(tree) * ((1u << 2 * level) - 1) / 3;
}

static tree_node load_node(const struct bd_native_tree *tree, struct place p)
{
    const uint32_t face = p.root / roots_of_face(tree);
    const size_t index = (size_t)face * level_first(tree, tree->args.level_count) +
                         level_first(tree, p.level) + p.morton;
    const struct bd_vec4 *v = &tree->nodes[index * BD_TREE_NODE_VEC4S];
    const lobe first = {f3_from(v + 5), f3_from(v + 6), v[5].w};
    return (tree_node){f3_from(v),     f3_from(v + 1), f3_from(v + 2), f3_from(v + 3),
                       f3_from(v + 4), v->w,           v[1].w,         v[2].w,
                       v[3].w,         v[4].w,         first};
}

static bool is_leaf(const struct bd_native_tree *tree, uint32_t level)
{
    return level + 1 == tree->args.level_count;
}

static uint32_t leaf_index(const struct bd_native_tree *tree, struct place p)
{
    const uint32_t side = tree->args.root_side << (tree->args.level_count - 1);
    const uint32_t face = p.root / roots_of_face(tree);
    return (face * side + every_second_bit(p.morton >> 1)) * side + every_second_bit(p.morton);
}

// --- loops over the lanes of a chunk ------------------------------------------------------------

static void find_bounds(const struct bd_receivers *restrict r, size_t first,
                        const tree_node *restrict node, float *restrict least, float *restrict most,
                        float *restrict r2)
{
    CHUNK_LANES(i)
    {
        const f3 position = f3_at(&r->position, i);
        const f3 to_node = f3_sub(node->position, position);
        const tree_bounds b =
            bounds_of(*node, position, f3_at(&r->normal, i), f3_at(&r->normal_geometric, i));
        r2[i] = f3_dot(to_node, to_node);
        least[i] = b.least;
        most[i] = b.most;
    }
}

// Who wants to look further down (shaders/common/tree_walk.glsl). Whether any does.
static uint32_t decide(struct walk *restrict w, size_t first, uint32_t level, const tree_node *node)
{
    const struct bd_gather_tree_args *args = &w->tree->args;
    const float side = (float)(args->root_side << level), relative = args->tau_relative;
    const float absolute = args->tau_absolute, estimate_min = args->estimate_min;
    const float of_light = args->face_extent * node->light_distance2, intensity = args->face_flux;
    uint32_t any = 0;
    switch (args->criterion) {
    case BD_TREE_CRITERION_BOUND:
        CHUNK_LANES(i) w->refine[i] = w->most[i] > absolute;
        break;
    case BD_TREE_CRITERION_LEVEL:
        CHUNK_LANES(i)
        w->refine[i] = absolute * (F_PI * side * side * w->r2[i] + of_light) <= intensity;
        break;
    default:
        CHUNK_LANES(i)
        w->refine[i] = w->most[i] - w->least[i] > relative * f_max(w->estimate[i], estimate_min);
    }
    CHUNK_LANES(i)
    {
        w->refine[i] &= w->active[level][i] & (w->most[i] > 0);
        any |= w->refine[i];
    }
    return any;
}

static void light_of_one_lobe(const struct bd_receivers *restrict r, size_t first,
                              const tree_node *restrict node, const uint32_t *restrict lit,
                              const float *restrict most, struct bd_receiver_light *restrict light)
{
    const lobe only = node->first;
    const float power = strongest(node->flux), strength = all_channels(node->flux);
    CHUNK_LANES(i)
    {
        const f3 position = f3_at(&r->position, i), n = f3_at(&r->normal, i);
        const f3 to_light = f3_sub(only.position, position);
        const float light_of_unit =
            light_of_lobe(only, power, position, n, f3_at(&r->normal_geometric, i), most[i]);
        const float kernel = f_select(lit[i] != 0, light_of_unit, 0.0f);
        const f3 unit = direction_of_unit(to_light, f3_dot(to_light, to_light), n);
        f3_add_at(&light->irradiance, i, f3_scale(node->flux, kernel));
        f3_add_at(&light->vector, i, f3_scale(unit, strength * kernel));
    }
}

static void light_of_two_lobes(const struct bd_receivers *restrict r, size_t first,
                               const tree_node *restrict node, const uint32_t *restrict lit,
                               const float *restrict most, struct bd_receiver_light *restrict light)
{
    const lobe one = node->first, other = second_lobe(*node);
    const float power = strongest(node->flux), strength = all_channels(node->flux);
    CHUNK_LANES(i)
    {
        const f3 position = f3_at(&r->position, i), n = f3_at(&r->normal, i);
        const inner_light l =
            light_of_inner(one, other, power, position, n, f3_at(&r->normal_geometric, i), most[i]);
        const float kernel = f_select(lit[i] != 0, l.kernel, 0.0f);
        const f3 to_light = direction_of_inner(one, other, l.share, position);
        const f3 unit = direction_of_unit(to_light, f3_dot(to_light, to_light), n);
        f3_add_at(&light->irradiance, i, f3_scale(node->flux, kernel));
        f3_add_at(&light->vector, i, f3_scale(unit, strength * kernel));
    }
}

// Whether any lane is so near that it must be integrated as a patch.
static uint32_t light_of_leaf(const struct bd_receivers *restrict r, size_t first,
                              const tree_node *restrict node, const uint32_t *restrict lit,
                              float near2, uint32_t *restrict near,
                              struct bd_receiver_light *restrict light)
{
    uint32_t any = 0;
    CHUNK_LANES(i)
    {
        const f3 n = f3_at(&r->normal, i);
        const f3 to_leaf = f3_sub(node->first.position, f3_at(&r->position, i));
        const float r2 = f3_dot(to_leaf, to_leaf);
        const bool is_near = b_and(r2 < near2, faces(node->normal, to_leaf, r2));
        float kernel = disk_light(n, f3_at(&r->normal_geometric, i), to_leaf, r2,
                                  node->first.normal, node->area, VPL_UNBOUNDED);
        kernel = f_select(b_and(lit[i] != 0, !is_near), kernel, 0.0f);
        const f3 irradiance = f3_scale(node->flux, kernel);
        f3_add_at(&light->irradiance, i, irradiance);
        f3_add_at(&light->vector, i,
                  f3_scale(direction_of_unit(to_leaf, r2, n), all_channels(irradiance)));
        near[i] = is_near & lit[i];
        any |= near[i];
    }
    return any;
}

static void spread_of_lanes(const struct bd_receivers *restrict r, size_t first,
                            const tree_node *restrict node, const uint32_t *restrict lit,
                            float *restrict spread)
{
    const float strength = all_channels(node->flux);
    CHUNK_LANES(i)
    {
        const f3 to_node = f3_sub(node->position, f3_at(&r->position, i));
        const float part =
            spread_of_vpl(r->radius[i], r->off_plane[i], f3_at(&r->normal_geometric, i), to_node,
                          f3_dot(to_node, to_node), node->normal, node->area, strength);
        spread[i] += f_select(lit[i] != 0, part, 0.0f);
    }
}

// --- the walk -----------------------------------------------------------------------------------

static void take_leaf(struct walk *w, size_t first, struct place at, const tree_node *node,
                      bool near_patches)
{
    const float near2 = near_patches ? node->near2 : 0;
    if (!light_of_leaf(w->receivers, first, node, w->lit, near2, w->near, &w->sums)) return;
    CHUNK_LANES(i)
    if (w->near[i])
        add_pair(&w->pairs, w->receivers, (uint32_t)i, &w->tree->leaves, leaf_index(w->tree, at),
                 &w->sums);
}

// Those of a chunk who take the node: all, or but those who look further down. Whether any does.
static uint32_t find_lit(struct walk *restrict w, size_t first, uint32_t level, bool goes_down)
{
    uint32_t any = 0;
    CHUNK_LANES(i)
    {
        const uint32_t leaves = goes_down ? w->refine[i] : 0;
        w->lit[i] = w->active[level][i] & !leaves & (w->most[i] > 0);
        any |= w->lit[i];
    }
    return any;
}

// Lights those of a chunk who take the node; whether others look further down.
static bool visit_chunk(struct walk *w, size_t first, struct place at, const tree_node *node,
                        const struct bd_native_wishes *wishes)
{
    const bool leaf = is_leaf(w->tree, at.level);
    find_bounds(w->receivers, first, node, w->least, w->most, w->r2);
    const bool goes_down = !leaf && decide(w, first, at.level, node);
    if (!find_lit(w, first, at.level, goes_down)) return goes_down;
    if (wishes->spread) spread_of_lanes(w->receivers, first, node, w->lit, w->sums.spread);
    if (leaf)
        take_leaf(w, first, at, node, wishes->near_patches);
    else if (node->first.share < 1 - LOBE_SHARE_MIN)
        light_of_two_lobes(w->receivers, first, node, w->lit, w->most, &w->sums);
    else
        light_of_one_lobe(w->receivers, first, node, w->lit, w->most, &w->sums);
    return goes_down;
}

// Whether any lane looks further down.
static bool visit(struct walk *w, struct place at, const struct bd_native_wishes *wishes)
{
    const tree_node node = load_node(w->tree, at);
    bool any = false;
    if (!(strongest(node.flux) > 0)) return false;
    for (size_t c = 0; c < CHUNKS; c++) {
        const bool goes_down =
            w->chunks[at.level][c] && visit_chunk(w, c * CHUNK, at, &node, wishes);
        w->chunks[at.level + 1][c] = goes_down;
        if (goes_down)
            memcpy(&w->active[at.level + 1][c * CHUNK], &w->refine[c * CHUNK],
                   CHUNK * sizeof *w->refine);
        any |= goes_down;
    }
    return any;
}

static void walk_root(struct walk *w, uint32_t root, const struct bd_native_wishes *wishes)
{
    struct place at = {root, 0, root % roots_of_face(w->tree)};
    for (;;) {
        if (visit(w, at, wishes)) {
            at.level++;
            at.morton *= 4;
            continue;
        }
        if (at.level == 0) return;
        for (at.morton++; at.level > 0 && at.morton % 4 == 0; at.level--) at.morton /= 4;
        if (at.level == 0) return;
    }
}

static void begin(struct walk *restrict w, const uint32_t *restrict steps)
{
    const struct bd_receivers *restrict r = w->receivers;
    const float steps_of_unit = w->tree->args.steps_per_unit;
    // Signed numbers' conversion is one instruction everywhere.
    LANES(i)
    {
        const float few = (float)(int32_t)steps[i], many = (float)(int32_t)(steps[i] >> 1) * 2.0f;
        w->estimate[i] = f_select(steps[i] <= INT32_MAX, few, many) / steps_of_unit;
    }
    for (size_t i = 0; i < BD_LANES; i++) {
        w->active[0][i] = r->lit[i] > 0;
        w->chunks[0][i / CHUNK] |= r->lit[i] > 0;
    }
}

void WIDE(bd_native_gather_tree)(const struct bd_receivers *receivers,
                                 const struct bd_native_tree *tree,
                                 const struct bd_native_wishes *wishes,
                                 const uint32_t steps[BD_LANES], struct bd_receiver_light *light)
{
    struct walk walk;
    struct bd_native_wishes own = *wishes;
    BD_ASSERT_CMP(tree->args.level_count, <=, LEVELS_MAX);
    if (!any_is_lit(receivers)) return;
    own.spread &= any_is_a_block(receivers);
    memset(&walk, 0, sizeof walk);
    walk.receivers = receivers;
    walk.tree = tree;
    begin(&walk, steps);
    for (uint32_t root = 0; root < tree->args.root_count; root++)
        walk_root(&walk, tree->args.first_root + root, &own);
    flush_pairs(&walk.pairs, &walk.sums);
    keep_sums(receivers, &walk.sums, light);
}

// --- estimates ----------------------------------------------------------------------------------

#define STEPS_MAX 16777216.0f // of one light: exact as a float, and 256 of them in 32 bits

static void add_leaf_root(const struct bd_receivers *restrict r, const tree_node *restrict node,
                          float power, float *restrict sum)
{
    LANES(i)
    {
        const f3 position = f3_at(&r->position, i), n = f3_at(&r->normal, i);
        const f3 n_geometric = f3_at(&r->normal_geometric, i);
        const f3 to_leaf = f3_sub(node->first.position, position);
        const float most = bounds_of(*node, position, n, n_geometric).most;
        const float kernel = disk_light(n, n_geometric, to_leaf, f3_dot(to_leaf, to_leaf),
                                        node->first.normal, node->area, VPL_UNBOUNDED);
        sum[i] += f_select(most > 0.0f, power * kernel, 0.0f);
    }
}

static void add_inner_root(const struct bd_receivers *restrict r, const tree_node *restrict node,
                           float power, float *restrict sum)
{
    const lobe first = node->first, second = second_lobe(*node);
    LANES(i)
    {
        const f3 position = f3_at(&r->position, i), n = f3_at(&r->normal, i);
        const f3 n_geometric = f3_at(&r->normal_geometric, i);
        const float most = bounds_of(*node, position, n, n_geometric).most;
        const inner_light l = light_of_inner(first, second, power, position, n, n_geometric, most);
        sum[i] += f_select(most > 0.0f, power * l.kernel, 0.0f);
    }
}

void WIDE(bd_native_estimate)(const struct bd_receivers *receivers,
                              const struct bd_native_tree *tree, uint32_t steps[BD_LANES])
{
    const float steps_of_unit = tree->args.steps_per_unit;
    float sum[BD_LANES] = {0};
    if (!any_is_lit(receivers)) return;
    for (uint32_t i = 0; i < tree->args.root_count; i++) {
        const uint32_t root = tree->args.first_root + i;
        const struct place at = {root, 0, root % roots_of_face(tree)};
        const tree_node node = load_node(tree, at);
        const float power = strongest(node.flux);
        if (!(power > 0)) continue;
        if (is_leaf(tree, 0))
            add_leaf_root(receivers, &node, power, sum);
        else
            add_inner_root(receivers, &node, power, sum);
    }
    LANES(i) steps[i] += (uint32_t)(int32_t)f_min(sum[i] * steps_of_unit, STEPS_MAX);
}
