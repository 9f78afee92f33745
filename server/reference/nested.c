#include "reference/nested.h"

#include <stddef.h>
#include <string.h>

#include "reference/path.h"

static bool is_smaller(const struct bd_part *a, const struct bd_part *b)
{
    const double size_a = bd_solid_size_m2(a->instance, a->primitive);
    const double size_b = bd_solid_size_m2(b->instance, b->primitive);
    return size_a != size_b ? size_a < size_b : a->material < b->material;
}

// Which one an edge of that material leaves: the last; `count` where there is none.
static uint32_t last_of(const struct bd_nested *stack, const struct bd_material *material)
{
    uint32_t i = stack->count;
    while (i > 0 && stack->in[i - 1]->material != material) i--;
    return i > 0 ? i - 1 : stack->count;
}

// The smallest that holds the place, but for one; NULL: none.
static const struct bd_part *there(const struct bd_reference *reference,
                                   const struct bd_nested *stack, uint32_t but,
                                   const float position[3])
{
    const struct bd_geometry *geometry = &reference->geometry;
    const bd_dvec3 at = {position[0], position[1], position[2]};
    const bd_dvec3 world =
        bd_dvec3_add(geometry->origin_m, bd_dvec3_scale(at, 1 / geometry->units_per_m));
    const struct bd_part *found = NULL;
    for (uint32_t i = 0; i < stack->count; i++) {
        const struct bd_part *part = stack->in[i];
        if (i == but || !bd_solid_box_holds(geometry->scene, part->instance, world)) continue;
        if (!found || is_smaller(part, found)) found = part;
    }
    return found;
}

static const struct bd_medium *medium_of(const struct bd_reference *reference,
                                         const struct bd_part *part)
{
    if (!part) return NULL;
    const struct bd_medium *medium = &reference->media[part->primitive->material];
    return medium->absorbs ? medium : NULL;
}

struct bd_nested_edge bd_nested_edge_at(const struct bd_reference *reference,
                                        const struct bd_nested *stack,
                                        const struct bd_intersection *at, bool entering)
{
    const struct bd_part *own = at->part;
    const uint32_t but = entering ? stack->count : last_of(stack, own->material);
    const struct bd_part *beyond = there(reference, stack, but, at->position);
    struct bd_nested_edge edge = {
        .ior = own->material->ior,
        .inside = medium_of(reference, own),
        .outside = medium_of(reference, beyond),
    };
    if (!beyond) return edge;
    edge.is_none = beyond->material == own->material || is_smaller(beyond, own);
    if (edge.is_none) edge.inside = edge.outside;
    if (beyond->material->ior > 0) edge.ior /= beyond->material->ior;
    return edge;
}

const struct bd_medium *bd_nested_medium_at(const struct bd_reference *reference,
                                            const struct bd_nested *stack, const float position[3])
{
    return medium_of(reference, there(reference, stack, stack->count, position));
}

void bd_nested_cross(struct bd_nested *stack, const struct bd_part *part, bool entering)
{
    uint32_t forgotten = stack->count;
    if (entering && stack->count == BD_NESTED_MAX) forgotten = 0;
    if (!entering) forgotten = last_of(stack, part->material);
    // Bounded by several materials: it is the last one that ends.
    if (!entering && forgotten == stack->count && stack->count > 0) forgotten = stack->count - 1;
    if (forgotten < stack->count) {
        stack->count--;
        memmove(stack->in + forgotten, stack->in + forgotten + 1,
                (stack->count - forgotten) * sizeof *stack->in);
    }
    if (entering) stack->in[stack->count++] = part;
}
