#include "lights/point_tree.h"

#include <stdlib.h>

#include "lights/sequence.h"

// Of points' mean distance from each other: how far off one may be that stands for a place.
#define REACH 16.0f
// Beyond it a crowd of surfaces that face otherwise is searched no further.
#define VISITS_MAX  2048
#define OFF_PLANE   4.0f // as far as that along it
#define FACES_ALIKE 0.5f
// So few are looked at one by one: half the time of dividing them.
#define LEAF_POINTS 8u
// Dividing fewer takes a fraction of a millisecond.
#define POINTS_TO_PAUSE 4096u

struct building {
    enum bd_err (*pause)(void *user);
    void *user;
    enum bd_err err;
};

static float along(f3 v, uint32_t axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static uint32_t widest_axis(const struct bd_point_node *nodes, uint32_t count)
{
    float least[3], most[3];
    for (uint32_t a = 0; a < 3; a++) least[a] = most[a] = along(nodes[0].position, a);
    for (uint32_t i = 1; i < count; i++)
        for (uint32_t a = 0; a < 3; a++) {
            least[a] = f_min(least[a], along(nodes[i].position, a));
            most[a] = f_max(most[a], along(nodes[i].position, a));
        }
    uint32_t widest = 0;
    for (uint32_t a = 1; a < 3; a++)
        if (most[a] - least[a] > most[widest] - least[widest]) widest = a;
    return widest;
}

static bool is_before(const struct bd_point_node *a, const struct bd_point_node *b, uint32_t axis)
{
    const float x = along(a->position, axis), y = along(b->position, axis);
    return x != y ? x < y : a->point < b->point;
}

static void swap(struct bd_point_node *a, struct bd_point_node *b)
{
    const struct bd_point_node was = *a;
    *a = *b;
    *b = was;
}

static uint32_t part_at(struct bd_point_node *nodes, uint32_t count, uint32_t axis, uint32_t pivot)
{
    uint32_t at = 0;
    swap(&nodes[pivot], &nodes[count - 1]);
    for (uint32_t i = 0; i + 1 < count; i++)
        if (is_before(&nodes[i], &nodes[count - 1], axis)) swap(&nodes[i], &nodes[at++]);
    swap(&nodes[at], &nodes[count - 1]);
    return at;
}

// The one in the middle along the axis comes there, those before it before it (Hoare 1961).
static void part_in_the_middle(struct bd_point_node *nodes, uint32_t count, uint32_t axis)
{
    const uint32_t wanted = count / 2;
    uint32_t first = 0, left = count;
    while (left > 1) {
        // By no place that a scene could be made for.
        const uint32_t pivot = bd_stirred(left ^ first << 16) % left;
        const uint32_t at = first + part_at(nodes + first, left, axis, pivot);
        if (at == wanted) return;
        if (at > wanted) {
            left = at - first;
        } else {
            left -= at + 1 - first;
            first = at + 1;
        }
    }
}

static void divide(struct building *b, struct bd_point_node *nodes, uint32_t count)
{
    if (count >= POINTS_TO_PAUSE && !b->err) b->err = b->pause(b->user);
    if (count <= LEAF_POINTS || b->err) return;
    const uint32_t axis = widest_axis(nodes, count), middle = count / 2;
    part_in_the_middle(nodes, count, axis);
    nodes[middle].axis = axis & 3;
    divide(b, nodes, middle);
    divide(b, nodes + middle + 1, count - middle - 1);
}

enum bd_err bd_point_tree_init(struct bd_point_tree *tree, const struct bd_surface_points *points,
                               enum bd_err (*pause)(void *user), void *user,
                               struct bd_err_detail *detail)
{
    struct building building = {pause, user, BD_ERR_OK};
    *tree = (struct bd_point_tree){points->count, points->area,
                                   malloc((points->count + 1) * sizeof *tree->nodes)};
    if (!tree->nodes)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "vpls", "no memory for %u points",
                          points->count);
    for (uint32_t i = 0; i < points->count; i++)
        tree->nodes[i] = (struct bd_point_node){points->points[i].position,
                                                points->points[i].normal, i & 0x3fffffffu, 0};
    divide(&building, tree->nodes, points->count);
    if (building.err) bd_point_tree_finish(tree);
    return building.err;
}

void bd_point_tree_finish(struct bd_point_tree *tree)
{
    free(tree->nodes);
    *tree = (struct bd_point_tree){0};
}

// --- a place ------------------------------------------------------------------------------------

struct search {
    f3 position, normal;
    float within2; // nobody farther off is looked for
    uint32_t most, visits;
    struct bd_point_neighbours *found; // the nearest first; their distances squared as shares
};

static void keep(struct search *s, uint32_t point, float distance2)
{
    struct bd_point_neighbours *found = s->found;
    uint32_t at = found->count < s->most ? found->count++ : s->most - 1;
    for (; at > 0 && found->share[at - 1] > distance2; at--) {
        found->share[at] = found->share[at - 1];
        found->point[at] = found->point[at - 1];
    }
    found->share[at] = distance2;
    found->point[at] = point;
    if (found->count == s->most) s->within2 = found->share[s->most - 1];
}

static void consider(struct search *s, const struct bd_point_node *node)
{
    const f3 away = f3_sub(node->position, s->position);
    const float off = f3_dot(away, s->normal);
    const float distance2 = f3_dot(away, away) + (OFF_PLANE * OFF_PLANE - 1) * off * off;
    if (!(distance2 < s->within2)) return;
    if (f3_dot(node->normal, s->normal) < FACES_ALIKE) return;
    keep(s, node->point, distance2);
}

// The side that the place lies on first.
static void visit(struct search *s, const struct bd_point_node *nodes, uint32_t count)
{
    if (s->visits >= VISITS_MAX) return;
    if (count <= LEAF_POINTS) {
        for (uint32_t i = 0; i < count; i++) consider(s, &nodes[i]);
        s->visits += count;
        return;
    }
    const uint32_t middle = count / 2;
    const struct bd_point_node *node = &nodes[middle];
    const float off = along(s->position, node->axis) - along(node->position, node->axis);
    const struct bd_point_node *behind = node + 1;
    const uint32_t behind_count = count - middle - 1;
    s->visits++;
    if (off < 0)
        visit(s, nodes, middle);
    else
        visit(s, behind, behind_count);
    consider(s, node);
    if (off * off >= s->within2) return;
    if (off < 0)
        visit(s, behind, behind_count);
    else
        visit(s, nodes, middle);
}

void bd_point_tree_find(const struct bd_point_tree *tree, f3 position, f3 normal, uint32_t most,
                        struct bd_point_neighbours *out)
{
    struct search s = {.position = position,
                       .normal = normal,
                       .within2 = REACH * REACH * tree->area,
                       .most = most,
                       .found = out};
    out->count = 0;
    visit(&s, tree->nodes, tree->count);
    if (out->count == 0) return;
    // A parabola that ends a little behind the farthest (Epanechnikov 1969).
    const float end2 = 1.1f * out->share[out->count - 1] + 1e-30f;
    float sum = 0;
    for (uint32_t i = 0; i < out->count; i++) sum += out->share[i] = end2 - out->share[i];
    for (uint32_t i = 0; i < out->count; i++) out->share[i] /= sum;
}
