#include "pass/point_surfaces.h"

#include "pass/f3_arrays.h"

// Cosine between normals, and how far off the plane as a part of the distance.
#define ALIKE_LEAST    0.9f
#define OFF_PLANE_MOST 0.1f

static bool lies_on(const struct bd_point_surfaces *s, uint32_t k, f3 position, f3 normal)
{
    const f3 way = f3_sub(position, s->position[k]);
    const float off = f_abs(f3_dot(s->normal[k], way));
    return f3_dot(s->normal[k], normal) > ALIKE_LEAST && off <= OFF_PLANE_MOST * f3_length(way);
}

// The last takes whatever is left.
static uint32_t surface_of(struct bd_point_surfaces *s, f3 position, f3 normal)
{
    for (uint32_t k = 0; k < s->count; k++)
        if (lies_on(s, k, position, normal)) return k;
    if (s->count == BD_POINT_SURFACES_MAX) return BD_POINT_SURFACES_MAX - 1;
    s->position[s->count] = position;
    s->normal[s->count] = normal;
    return s->count++;
}

void bd_point_surfaces_of(const struct bd_receiver_part *part, const struct bd_receiver_set *set,
                          struct bd_point_surfaces *out)
{
    *out = (struct bd_point_surfaces){0};
    for (uint32_t i = 0; i < set->count; i++) {
        const struct bd_ray_starts *starts = &part->starts[set->places[i] / BD_LANES];
        const f3 position = f3_at(&starts->position, set->places[i] % BD_LANES);
        const f3 normal = f3_at(&starts->normal_geometric, set->places[i] % BD_LANES);
        out->of_place[i] = surface_of(out, position, normal);
        bd_points_about_add(&out->about[out->of_place[i]], position, normal);
    }
}
