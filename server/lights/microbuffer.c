#include "lights/microbuffer.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/vec.h"
#include "kernel/hemi_octahedral.h"

struct texel {
    double solid_angle;
    bd_dvec3 weight;
};

// Through a corner of a texel; corners are exact where the side is a power of two.
static bd_dvec3 way_of_corner(uint32_t u, uint32_t v, uint32_t side)
{
    const double x = 2.0 * u / side - 1, y = 2.0 * v / side - 1;
    const double a = 0.5 * (x + y), b = 0.5 * (x - y);
    const bd_dvec3 way = {a, b, 1 - fabs(a) - fabs(b)};
    return bd_dvec3_scale(way, 1 / sqrt(bd_dvec3_dot(way, way)));
}

// Van Oosterom and Strackee 1983.
static double solid_angle_of(bd_dvec3 a, bd_dvec3 b, bd_dvec3 c)
{
    const double volume = bd_dvec3_dot(a, bd_dvec3_cross(b, c));
    const double across = 1 + bd_dvec3_dot(a, b) + bd_dvec3_dot(b, c) + bd_dvec3_dot(c, a);
    return 2 * atan2(fabs(volume), across);
}

// An edge's part of the integral of the ways: half its angle, along the normal of its plane.
static bd_dvec3 edge_of(bd_dvec3 a, bd_dvec3 b)
{
    const bd_dvec3 normal = bd_dvec3_cross(a, b);
    const double sine = sqrt(bd_dvec3_dot(normal, normal));
    return bd_dvec3_scale(normal, 0.5 * atan2(sine, bd_dvec3_dot(a, b)) / sine);
}

static void add_triangle(struct texel *texel, bd_dvec3 a, bd_dvec3 b, bd_dvec3 c)
{
    const bd_dvec3 all = bd_dvec3_add(edge_of(a, b), bd_dvec3_add(edge_of(b, c), edge_of(c, a)));
    const bool is_turned = bd_dvec3_dot(all, a) < 0;
    texel->solid_angle += solid_angle_of(a, b, c);
    texel->weight = bd_dvec3_add(texel->weight, bd_dvec3_scale(all, is_turned ? -1 : 1));
}

static struct texel texel_at(uint32_t u, uint32_t v, uint32_t side)
{
    const bd_dvec3 near = way_of_corner(u, v, side), far = way_of_corner(u + 1, v + 1, side);
    struct texel texel = {0, {0, 0, 0}};
    add_triangle(&texel, near, way_of_corner(u + 1, v, side), far);
    add_triangle(&texel, far, way_of_corner(u, v + 1, side), near);
    return texel;
}

enum bd_err bd_microbuffer_init(struct bd_microbuffer *map, uint32_t side,
                                struct bd_err_detail *detail)
{
    const size_t count = (size_t)side * side;
    BD_ASSERT(side > 0 && side % 2 == 0);
    *map = (struct bd_microbuffer){side, malloc(count * sizeof *map->way),
                                   malloc(count * sizeof *map->solid_angle),
                                   malloc(count * sizeof *map->weight)};
    if (!map->way || !map->solid_angle || !map->weight) {
        bd_microbuffer_finish(map);
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "microbuffer", "no memory for %u texels", side);
    }
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t u = i % side, v = i / side;
        const struct texel texel = texel_at(u, v, side);
        const f3 way = way_of_place(place_of_texel((float)u + 0.5f, (float)side),
                                    place_of_texel((float)v + 0.5f, (float)side));
        map->way[i] = f3_unit(way);
        map->solid_angle[i] = (float)texel.solid_angle;
        map->weight[i] = f3_of((float)texel.weight.x, (float)texel.weight.y, (float)texel.weight.z);
    }
    return BD_ERR_OK;
}

enum bd_err bd_microbuffer_init_even(struct bd_microbuffer *map, uint32_t side,
                                     struct bd_err_detail *detail)
{
    const enum bd_err err = bd_microbuffer_init(map, side, detail);
    const float each = 2 * F_PI / (float)(side * side);
    for (uint32_t i = 0; !err && i < side * side; i++) {
        map->solid_angle[i] = each;
        map->weight[i] = f3_scale(map->way[i], each);
    }
    return err;
}

void bd_microbuffer_finish(struct bd_microbuffer *map)
{
    free(map->way);
    free(map->solid_angle);
    free(map->weight);
    *map = (struct bd_microbuffer){0};
}
