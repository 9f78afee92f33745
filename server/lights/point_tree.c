#include "lights/point_tree.h"

#include <stdlib.h>

// Of points' mean distance from each other: how far off one may be that stands for a place.
#define REACH 16.0f
// Beyond it a crowd of surfaces that face otherwise is searched no further.
#define VISITS_MAX  2048
#define OFF_PLANE   4.0f // as far as that along it
#define FACES_ALIKE 0.5f
// So few are looked at one by one: half the time of dividing them.
#define LEAF_POINTS 8u

struct building {
    enum bd_err (*pause)(void *user);
    void *user;
    enum bd_err err;
};

static void divide(struct building *b, struct bd_point_node *nodes, uint32_t count)
{
    if (count >= BD_POINTS_TO_PAUSE && !b->err) b->err = b->pause(b->user);
    if (count <= LEAF_POINTS || b->err) return;
    const uint32_t middle = count / 2;
    const uint32_t axis = bd_point_halves(nodes, count, middle);
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
    const float off = bd_along(s->position, node->axis) - bd_along(node->position, node->axis);
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
