// Points in a map of what a place sees, a lane each; texels keep what covers them one by one.

#include "pass/native/loops.h"

#include "kernel/projected_point.h"
#include "pass/native/lanes.h"

// Of a point: the way to it in the map's axes, and its normal times that.
struct ways {
    float x[BD_LANES], y[BD_LANES], z[BD_LANES], facing[BD_LANES];
    float normal_x[BD_LANES], normal_y[BD_LANES], normal_z[BD_LANES]; // in those axes
};

// Squares of texels, from the first to before the end; of who is not seen the key is NO_POINT.
struct squares {
    int32_t first_u[BD_LANES], first_v[BD_LANES], end_u[BD_LANES], end_v[BD_LANES];
    uint32_t key[BD_LANES];
};

static void look(const struct bd_native_place *restrict place,
                 const struct bd_native_points *restrict points, struct ways *restrict ways)
{
    const f3 from = place->position, across = place->across, along = place->along;
    const f3 up = place->normal;
    LANES(i)
    {
        const struct bd_projected_point *point = &points->points[i];
        const f3 way = f3_sub(f3_of(point->x, point->y, point->z), from);
        const f3 to = in_axes(way, across, along, up);
        ways->x[i] = to.x;
        ways->y[i] = to.y;
        ways->z[i] = to.z;
        const f3 normal = in_axes(normal_of_bits(point->normal), across, along, up);
        ways->facing[i] = f3_dot(normal, to);
        ways->normal_x[i] = normal.x;
        ways->normal_y[i] = normal.y;
        ways->normal_z[i] = normal.z;
    }
}

// `as_printed`, here and below: a constant of who calls, so that each has a loop without a choice.
static inline void weigh(const struct ways *restrict ways, const float *restrict area,
                         bool as_printed, float *restrict importance)
{
    LANES(i)
    {
        const f3 to = f3_of(ways->x[i], ways->y[i], ways->z[i]);
        const float r2 = f_max(f3_dot(to, to), NEAREST_R2);
        const float facing = f_abs(ways->facing[i]);
        const float may_give =
            f_select(as_printed, importance_of_point_printed(to.z, facing, r2, area[i]),
                     importance_of_point(to.z, facing, r2, area[i]));
        importance[i] = f_select(is_point_seen(to.z, ways->facing[i], r2), may_give, 0.0f);
    }
}

void WIDE(bd_native_weigh_points)(const struct bd_native_place *place,
                                  const struct bd_native_points *points, bool as_printed,
                                  float importance[BD_LANES])
{
    struct ways ways;
    look(place, points, &ways);
    if (as_printed)
        weigh(&ways, points->area, true, importance);
    else
        weigh(&ways, points->area, false, importance);
}

static inline void cover(const struct ways *restrict ways,
                         const struct bd_native_points *restrict points, float side,
                         bool as_printed, uint32_t first_slot, uint32_t chance,
                         struct squares *restrict squares)
{
    LANES(i)
    {
        const f3 to = f3_of(ways->x[i], ways->y[i], ways->z[i]);
        const f3 normal = f3_of(ways->normal_x[i], ways->normal_y[i], ways->normal_z[i]);
        const uint slot = stirred_slot(first_slot + (uint32_t)i);
        const uint drawn = drawn_by_point(points->names[i], chance);
        const point_square square = square_of_point(to, normal, ways->facing[i], points->area[i],
                                                    side, as_printed, slot, drawn);
        squares->first_u[i] = (int32_t)square.first_u;
        squares->first_v[i] = (int32_t)square.first_v;
        squares->end_u[i] = (int32_t)square.end_u;
        squares->end_v[i] = (int32_t)square.end_v;
        squares->key[i] = square.key;
    }
}

static void keep_at(uint32_t *texel, uint32_t key)
{
    *texel = key < *texel ? key : *texel;
}

// Nearly all are one or two texels wide: those without a choice, some of them twice.
static void keep_square(const struct squares *squares, size_t i, uint32_t side, uint32_t *map)
{
    const uint32_t key = squares->key[i];
    const int32_t u = squares->first_u[i], v = squares->first_v[i];
    const int32_t end_u = squares->end_u[i], end_v = squares->end_v[i];
    uint32_t *row = map + (size_t)v * side;
    uint32_t *next = row + (end_v > v + 1 ? side : 0);
    const int32_t beside = end_u > u + 1 ? u + 1 : u;
    keep_at(&row[u], key);
    keep_at(&row[beside], key);
    keep_at(&next[u], key);
    keep_at(&next[beside], key);
    if (end_u <= u + 2 && end_v <= v + 2) return;
    for (int32_t y = v; y < end_v; y++)
        for (int32_t x = u; x < end_u; x++) keep_at(&map[(size_t)y * side + (size_t)x], key);
}

void WIDE(bd_native_project)(const struct bd_native_place *place,
                             const struct bd_native_points *points, uint32_t first_slot,
                             const struct bd_native_map *map, uint32_t turns_away[BD_LANES])
{
    struct ways ways;
    struct squares squares;
    look(place, points, &ways);
    if (map->as_printed)
        cover(&ways, points, (float)map->side, true, first_slot, place->chance, &squares);
    else
        cover(&ways, points, (float)map->side, false, first_slot, place->chance, &squares);
    LANES(i) turns_away[i] = ways.facing[i] >= 0.0f;
    for (size_t i = 0; i < points->count; i++)
        if (squares.key[i] != NO_POINT) keep_square(&squares, i, map->side, map->keys);
}
