#include "lights/point_halves.h"

#include "lights/sequence.h"

static uint32_t widest_axis(const struct bd_point_node *nodes, uint32_t count)
{
    float least[3], most[3];
    for (uint32_t a = 0; a < 3; a++) least[a] = most[a] = bd_along(nodes[0].position, a);
    for (uint32_t i = 1; i < count; i++)
        for (uint32_t a = 0; a < 3; a++) {
            least[a] = f_min(least[a], bd_along(nodes[i].position, a));
            most[a] = f_max(most[a], bd_along(nodes[i].position, a));
        }
    uint32_t widest = 0;
    for (uint32_t a = 1; a < 3; a++)
        if (most[a] - least[a] > most[widest] - least[widest]) widest = a;
    return widest;
}

static bool is_before(const struct bd_point_node *a, const struct bd_point_node *b, uint32_t axis)
{
    const float x = bd_along(a->position, axis), y = bd_along(b->position, axis);
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

// The one that is to stand there comes there, those before it before it (Hoare 1961).
static void part(struct bd_point_node *nodes, uint32_t count, uint32_t axis, uint32_t wanted)
{
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

uint32_t bd_point_halves(struct bd_point_node *nodes, uint32_t count, uint32_t first_count)
{
    const uint32_t axis = widest_axis(nodes, count);
    part(nodes, count, axis, first_count);
    return axis;
}
