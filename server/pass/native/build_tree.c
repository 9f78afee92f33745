// Nodes of one level of a tree of VPLs (shared/vpl_tree.h), a lane each, as
// shaders/pass/vpl_tree makes them: leaves from the list, inner nodes from the four below.

#include "pass/native/loops.h"

#include "base/assert.h"
#include "kernel/morton.h"
#include "kernel/vpl_tree_build.h"
#include "pass/native/lanes.h"
#include "shared/vpl.h"
#include "shared/vpl_tree.h"

#define NODE_FLOATS (4 * BD_TREE_NODE_VEC4S)
#define CHILDREN    4u
#define LOBES       (2 * CHILDREN)

// As nodes and VPLs lie in their arrays, each number of all lanes side by side.
struct node_lanes {
    struct bd_lanes3 position;
    float area[BD_LANES];
    struct bd_lanes3 normal;
    float chord[BD_LANES];
    struct bd_lanes3 flux;
    float radiosity[BD_LANES];
    struct bd_lanes3 box_min;
    float light_distance2[BD_LANES];
    struct bd_lanes3 box_max;
    float near2[BD_LANES];
    struct bd_lanes3 first_position;
    float first_share[BD_LANES];
    struct bd_lanes3 first_normal;
    float unused[BD_LANES];
};
struct vpl_lanes {
    struct bd_lanes3 position;
    float area[BD_LANES];
    struct bd_lanes3 normal;
    float near2[BD_LANES];
    struct bd_lanes3 flux;
    float along_u[BD_LANES];
};
struct quad_lanes {
    struct bd_lanes3 u;
    float inverse_area[BD_LANES];
    struct bd_lanes3 v;
    float along_v[BD_LANES];
};
_Static_assert(sizeof(struct node_lanes) == NODE_FLOATS * BD_LANES * sizeof(float), "as stored");
_Static_assert(sizeof(struct vpl_lanes) == 4 * BD_VPL_VEC4S * BD_LANES * sizeof(float),
               "as stored");
_Static_assert(sizeof(struct quad_lanes) == 4 * BD_VPL_QUAD_VEC4S * BD_LANES * sizeof(float),
               "as stored");

struct lobe_lanes {
    struct bd_lanes3 position, normal;
    float share[BD_LANES];
};

// --- in memory and side by side -----------------------------------------------------------------

// Lanes behind the last do what it does.
static uint32_t lane_of(size_t i, uint32_t count)
{
    return i < count ? (uint32_t)i : count - 1;
}

static void load_lane(void *lanes, size_t i, const struct bd_vec4 *from, size_t vec4s)
{
    float *to = (float *)lanes + i;
    for (size_t k = 0; k < vec4s; k++) {
        to[(4 * k + 0) * BD_LANES] = from[k].x;
        to[(4 * k + 1) * BD_LANES] = from[k].y;
        to[(4 * k + 2) * BD_LANES] = from[k].z;
        to[(4 * k + 3) * BD_LANES] = from[k].w;
    }
}

static void store_lane(const void *lanes, size_t i, struct bd_vec4 *to, size_t vec4s)
{
    const float *from = (const float *)lanes + i;
    for (size_t k = 0; k < vec4s; k++)
        to[k] = (struct bd_vec4){from[(4 * k + 0) * BD_LANES], from[(4 * k + 1) * BD_LANES],
                                 from[(4 * k + 2) * BD_LANES], from[(4 * k + 3) * BD_LANES]};
}

// Nodes that send nothing.
static void clear_nodes(struct node_lanes *n)
{
    *n = (struct node_lanes){0};
    LANES(i)
    {
        f3_put_at(&n->box_min, i, f3_of(TREE_FAR, TREE_FAR, TREE_FAR));
        f3_put_at(&n->box_max, i, f3_of(-TREE_FAR, -TREE_FAR, -TREE_FAR));
    }
}

// What lanes without flux have found is not a node's.
static void store_nodes(const struct node_lanes *n, uint32_t count, struct bd_vec4 *nodes)
{
    struct node_lanes nothing;
    clear_nodes(&nothing);
    for (uint32_t i = 0; i < count; i++) {
        const bool sends = strongest(f3_at(&n->flux, i)) > 0;
        store_lane(sends ? n : &nothing, i, &nodes[(size_t)i * BD_TREE_NODE_VEC4S],
                   BD_TREE_NODE_VEC4S);
    }
}

// --- leaves -------------------------------------------------------------------------------------

static void find_leaves(const struct vpl_lanes *restrict vpl,
                        const struct quad_lanes *restrict quad, f3 light, bool directional,
                        struct node_lanes *restrict n)
{
    LANES(i)
    {
        const f3 position = f3_at(&vpl->position, i), normal = f3_at(&vpl->normal, i);
        const f3 flux = f3_at(&vpl->flux, i), u = f3_at(&quad->u, i), v = f3_at(&quad->v, i);
        n->area[i] = vpl->area[i];
        n->near2[i] = vpl->near2[i];
        n->chord[i] = patch_chord(normal, u, v);
        n->radiosity[i] = radiosity_of_vpl(flux, vpl->area[i]);
        f3_put_at(&n->box_min, i, f3_sub(position, patch_reach(u, v)));
        f3_put_at(&n->box_max, i, f3_add(position, patch_reach(u, v)));
    }
    LANES(i)
    {
        n->light_distance2[i] = distance2_of_light(f3_at(&vpl->position, i), light, directional);
        n->first_share[i] = 1;
        n->unused[i] = 0;
    }
    n->position = n->first_position = vpl->position;
    n->normal = n->first_normal = vpl->normal;
    n->flux = vpl->flux;
}

void WIDE(bd_native_make_leaves)(const struct bd_native_leaves *leaves, struct bd_vec4 *nodes)
{
    struct vpl_lanes vpl;
    struct quad_lanes quad;
    struct node_lanes n;
    BD_ASSERT_CMP(leaves->count - 1, <, BD_LANES);
    LANES(i)
    {
        const uint32_t morton = leaves->first + lane_of(i, leaves->count);
        const size_t x = every_second_bit(morton), y = every_second_bit(morton >> 1);
        const size_t index = y * leaves->side + x;
        load_lane(&vpl, i, &leaves->vpls[index * BD_VPL_VEC4S], BD_VPL_VEC4S);
        load_lane(&quad, i, &leaves->quads[index * BD_VPL_QUAD_VEC4S], BD_VPL_QUAD_VEC4S);
    }
    find_leaves(&vpl, &quad, f3_from(&leaves->light), leaves->directional, &n);
    store_nodes(&n, leaves->count, nodes);
}

// --- inner nodes --------------------------------------------------------------------------------

static void add_child(const struct node_lanes *restrict child, struct node_lanes *restrict n)
{
    LANES(i)
    {
        f3_add_at(&n->flux, i, f3_at(&child->flux, i));
        n->area[i] += child->area[i];
        n->radiosity[i] += child->radiosity[i];
        n->light_distance2[i] = f_max(n->light_distance2[i], child->light_distance2[i]);
    }
    LANES(i)
    {
        f3_put_at(&n->box_min, i, least_corner(f3_at(&n->box_min, i), f3_at(&child->box_min, i)));
        f3_put_at(&n->box_max, i,
                  greatest_corner(f3_at(&n->box_max, i), f3_at(&child->box_max, i)));
    }
}

static void add_mean(const struct node_lanes *restrict child, struct node_lanes *restrict n,
                     float *restrict share)
{
    LANES(i)
    {
        share[i] = share_of_child(f3_at(&child->flux, i), f3_at(&n->flux, i));
        f3_add_at(&n->position, i, f3_scale(f3_at(&child->position, i), share[i]));
        f3_add_at(&n->normal, i, f3_scale(f3_at(&child->normal, i), share[i]));
    }
}

static void widen_chord(const struct node_lanes *restrict child,
                        const struct bd_lanes3 *restrict normal, float *restrict chord)
{
    LANES(i)
    chord[i] = f_max(chord[i], chord_with_child(f3_at(&child->flux, i), f3_at(&child->normal, i),
                                                child->chord[i], f3_at(normal, i)));
}

// --- lobes --------------------------------------------------------------------------------------

// A child's two, as parts of its parent.
static void split_child(const struct node_lanes *restrict child, const float *restrict share,
                        struct lobe_lanes *restrict one, struct lobe_lanes *restrict other)
{
    LANES(i)
    {
        const lobe first = {f3_at(&child->first_position, i), f3_at(&child->first_normal, i),
                            child->first_share[i]};
        const lobe second = second_lobe((tree_node){.position = f3_at(&child->position, i),
                                                    .normal = f3_at(&child->normal, i),
                                                    .first = first});
        f3_put_at(&one->position, i, first.position);
        f3_put_at(&one->normal, i, f3_scale(first.normal, share[i]));
        one->share[i] = first.share * share[i];
        f3_put_at(&other->position, i, second.position);
        f3_put_at(&other->normal, i, f3_scale(second.normal, share[i]));
        other->share[i] = second.share * share[i];
    }
}

// Goes on with the normal of the lobe that has most of something.
static void take_more(const float *restrict much, const struct bd_lanes3 *restrict own,
                      float *restrict most, struct bd_lanes3 *restrict normal)
{
    LANES(i)
    {
        const bool is_more = much[i] > most[i];
        const f3 before = f3_at(normal, i), after = f3_at(own, i);
        most[i] = f_max(most[i], much[i]);
        f3_put_at(normal, i, f3_select(is_more, after, before));
    }
}

static void find_largest(const struct lobe_lanes lobes[LOBES], struct bd_lanes3 *normal)
{
    float most[BD_LANES], much[BD_LANES];
    LANES(i) most[i] = -1;
    for (uint32_t k = 0; k < LOBES; k++) {
        LANES(i) much[i] = in_steps(lobes[k].share[i]);
        take_more(much, &lobes[k].normal, most, normal);
    }
}

static void find_farthest(const struct lobe_lanes lobes[LOBES], const struct bd_lanes3 *from,
                          struct bd_lanes3 *normal)
{
    float most[BD_LANES], much[BD_LANES];
    LANES(i) most[i] = -1;
    for (uint32_t k = 0; k < LOBES; k++) {
        LANES(i) much[i] = off_direction(f3_at(&lobes[k].normal, i), f3_at(from, i));
        take_more(much, &lobes[k].normal, most, normal);
    }
}

static void make_unit(const struct bd_lanes3 *restrict normal, struct bd_lanes3 *restrict direction)
{
    LANES(i) f3_put_at(direction, i, direction_of_lobe(f3_at(normal, i)));
}

static void join_lobe(const struct lobe_lanes *restrict l, const struct bd_lanes3 *restrict largest,
                      const struct bd_lanes3 *restrict other, struct bd_lanes3 *restrict position,
                      struct bd_lanes3 *restrict normal, float *restrict share)
{
    LANES(i)
    {
        const f3 own = f3_at(&l->normal, i);
        const float part = part_of_first(own, f3_at(largest, i), f3_at(other, i));
        f3_add_at(position, i, f3_scale(f3_at(&l->position, i), part * l->share[i]));
        f3_add_at(normal, i, f3_scale(own, part));
        share[i] += part * l->share[i];
    }
}

static void find_first_lobe(const struct lobe_lanes lobes[LOBES], struct node_lanes *n)
{
    struct bd_lanes3 normal = lobes[0].normal, largest, other;
    find_largest(lobes, &normal);
    make_unit(&normal, &largest);
    find_farthest(lobes, &largest, &normal);
    make_unit(&normal, &other);
    for (uint32_t k = 0; k < LOBES; k++)
        join_lobe(&lobes[k], &largest, &other, &n->first_position, &n->first_normal,
                  n->first_share);
    LANES(i)
    f3_put_at(&n->first_position, i,
              f3_scale(f3_at(&n->first_position, i), 1.0f / n->first_share[i]));
}

void WIDE(bd_native_join_nodes)(const struct bd_vec4 *children, uint32_t count,
                                struct bd_vec4 *nodes)
{
    struct node_lanes child[CHILDREN], n;
    struct lobe_lanes lobes[LOBES];
    float share[CHILDREN][BD_LANES];
    BD_ASSERT_CMP(count - 1, <, BD_LANES);
    for (uint32_t k = 0; k < CHILDREN; k++) LANES(i)
    load_lane(&child[k], i,
              &children[(CHILDREN * lane_of(i, count) + k) * (size_t)BD_TREE_NODE_VEC4S],
              BD_TREE_NODE_VEC4S);
    clear_nodes(&n);
    for (uint32_t k = 0; k < CHILDREN; k++) add_child(&child[k], &n);
    for (uint32_t k = 0; k < CHILDREN; k++) add_mean(&child[k], &n, share[k]);
    for (uint32_t k = 0; k < CHILDREN; k++) widen_chord(&child[k], &n.normal, n.chord);
    for (uint32_t k = 0; k < CHILDREN; k++)
        split_child(&child[k], share[k], &lobes[2 * k], &lobes[2 * k + 1]);
    find_first_lobe(lobes, &n);
    store_nodes(&n, count, nodes);
}
