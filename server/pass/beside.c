#include "pass/beside.h"

#include <stdlib.h>

#include "kernel/lift.h"
#include "kernel/projected_point.h"
#include "pass/f3_arrays.h"
#include "pass/receivers.h"

// In distances between points: so near one stands for where a ray ends.
#define REACH 4.0f
// At all points that are searched, from the end and from where the ray starts.
#define LOOKS_MOST (2 * BD_NEAREST_MOST)
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_SEARCH 20.0

_Static_assert(BD_BESIDE_NONE == BD_NO_POINT_NEAR && BD_BESIDE_NONE == BD_NO_CELL, "all say so");
_Static_assert(BD_CELLS_ABOUT_MOST == BD_NEAREST_MOST, "one room for either");

// --- room ---------------------------------------------------------------------------------------

void bd_beside_finish(struct bd_beside *b)
{
    void *rooms[] = {b->near, b->ends, b->asking, b->found, b->sides, b->segments, b->hidden};
    for (size_t i = 0; i < sizeof rooms / sizeof *rooms; i++) free(rooms[i]);
    *b = (struct bd_beside){.points = b->points,
                            .cells = b->cells,
                            .visibility = b->visibility,
                            .surfaces = b->surfaces};
}

static enum bd_err make_room(struct bd_beside *b, uint32_t count, struct bd_err_detail *detail)
{
    const size_t segments = 2 * (size_t)count;
    if (count <= b->room) return BD_ERR_OK;
    bd_beside_finish(b);
    b->near = malloc(count * sizeof *b->near);
    b->ends = malloc(count * sizeof *b->ends);
    b->asking = malloc(count * sizeof *b->asking);
    b->found = malloc(count * sizeof *b->found);
    b->sides = malloc(count * BD_NEAREST_MOST * sizeof *b->sides);
    b->segments = malloc(segments * sizeof *b->segments);
    b->hidden = malloc((segments + 31) / 32 * sizeof *b->hidden);
    if (!b->near || !b->ends || !b->asking || !b->found || !b->sides || !b->segments || !b->hidden)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "points", "no memory for ends of %u rays",
                          count);
    b->room = count;
    return BD_ERR_OK;
}

// --- ways ---------------------------------------------------------------------------------------

static f3 lifted(const struct bd_beside_place *at, float by)
{
    return f3_add(at->position, f3_scale(at->normal, by));
}

static void put_segment(struct bd_segment *segment, f3 from, f3 to)
{
    segment->from_triangle = segment->to_triangle = BD_NO_TRIANGLE;
    f3_store(segment->from, from);
    f3_store(segment->to, to);
}

// How far the other lies under the place's plane.
static float under(const struct bd_beside_place *at, f3 other)
{
    return f3_dot(at->normal, f3_sub(at->position, other));
}

// It bends over where both planes meet.
void bd_way_beside(struct bd_segment way[2], const struct bd_beside_place *a,
                   const struct bd_beside_place *b)
{
    const float lift = lift_of_segment(0, a->position, b->position);
    const f3 from = lifted(a, lift), to = lifted(b, lift);
    const f3 middle = f3_scale(f3_add(a->position, b->position), 0.5f);
    const f3 up = f3_add(a->normal, b->normal);
    const float height =
        f_max(under(a, middle) / f3_dot(up, a->normal), under(b, middle) / f3_dot(up, b->normal));
    const bool bends = f_max(under(a, b->position), under(b, a->position)) > 0.25f * lift;
    const f3 over = bends ? f3_add(middle, f3_scale(up, height + lift)) : to;
    put_segment(&way[0], from, over);
    put_segment(&way[1], over, to);
}

static struct bd_beside_place place_of_point(const struct bd_point_clusters *points, uint32_t side)
{
    const struct bd_projected_point *point = &points->points[side / 2];
    return (struct bd_beside_place){
        .position = f3_of(point->x, point->y, point->z),
        .normal = f3_scale(normal_of_bits(point->normal), side % 2 ? -1 : 1),
    };
}

static struct bd_beside_place place_of(const struct bd_beside *b, uint32_t near)
{
    if (b->points) return place_of_point(b->points, near);
    const struct bd_cell_place *at = &b->cells->places[near];
    return (struct bd_beside_place){at->position, at->normal};
}

static void put_way_from_start(const struct bd_beside *b, uint32_t i,
                               const struct bd_beside_place *at, struct bd_segment way[2])
{
    const f3 start = f3_loaded(b->rays[i].origin);
    const f3 to = lifted(at, lift_of_segment(0, start, at->position));
    put_segment(&way[0], start, to);
    put_segment(&way[1], to, to);
}

// --- looks --------------------------------------------------------------------------------------

static bool find_end(const struct bd_beside *b, uint32_t i)
{
    const struct bd_ray_hit *hit = &b->hits[i];
    struct bd_surface_point at;
    if (hit->triangle == BD_NO_TRIANGLE ||
        !bd_surface_hit_at(b->surfaces, hit->triangle, hit->u, hit->v,
                           f3_loaded(b->rays[i].direction), &at))
        return false;
    b->ends[i] = (struct bd_beside_place){at.position, at.normal};
    return true;
}

// Light comes from there that nobody tells of. Where no point is near, none was to be lit.
static bool is_untold(const struct bd_beside *b, uint32_t i)
{
    const f3 normal = b->ends[i].normal;
    return b->found[i] > 0 || (b->cells && f3_dot(normal, normal) > 0);
}

static uint32_t search_about(const struct bd_beside *b, const struct bd_beside_place *end,
                             uint32_t *sides, uint32_t most)
{
    if (b->cells)
        return bd_irradiance_cells_about(b->cells, end->position, end->normal, sides, most);
    const float reach = REACH * f_sqrt(b->points->area);
    return bd_point_clusters_nearest(b->points, end->position, end->normal, reach, sides, most);
}

// At first the nearest alone: most see it.
static void search(const struct bd_beside *b, uint32_t i)
{
    uint32_t *sides = &b->sides[(size_t)i * BD_NEAREST_MOST];
    b->found[i] = 0;
    if (b->looks == 0) b->ends[i] = (struct bd_beside_place){0};
    if (b->looks > 0 || find_end(b, i))
        b->found[i] =
            (uint8_t)search_about(b, &b->ends[i], sides, b->looks == 0 ? 1 : BD_NEAREST_MOST);
}

// At what was found from the end, then from the start. Where none is left there is nothing to ask.
static void look(const struct bd_beside *b, uint32_t k)
{
    const uint32_t i = b->asking[k];
    const uint32_t *sides = &b->sides[(size_t)i * BD_NEAREST_MOST];
    struct bd_segment *way = &b->segments[2 * (size_t)k];
    if (b->looks < 2) search(b, i);
    const uint32_t found = b->found[i];
    if (b->looks >= 2 * found) {
        b->near[i] = is_untold(b, i) ? BD_BESIDE_HIDDEN : BD_BESIDE_NONE;
        put_segment(&way[0], f3_of(0, 0, 0), f3_of(0, 0, 0));
        way[1] = way[0];
        return;
    }
    b->near[i] = sides[b->looks % found];
    const struct bd_beside_place at = place_of(b, b->near[i]);
    if (b->looks < found)
        bd_way_beside(way, &b->ends[i], &at);
    else
        put_way_from_start(b, i, &at, way);
}

static void look_in_group(void *user, uint32_t group)
{
    const struct bd_beside *b = user;
    for (uint32_t k = group * BD_LANES; k < (group + 1) * BD_LANES && k < b->count; k++) look(b, k);
}

// Those go on whose point or cell is hidden.
static void keep_hidden(struct bd_beside *b)
{
    uint32_t kept = 0;
    for (uint32_t k = 0; k < b->count; k++)
        if (b->hidden[k / 16] >> 2 * (k % 16) & 3) b->asking[kept++] = b->asking[k];
    b->count = kept;
}

enum bd_err bd_beside_find(const struct bd_pass_context *context, struct bd_beside *b,
                           const struct bd_ray *rays, const struct bd_ray_hit *hits, uint32_t count,
                           struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    enum bd_err err = make_room(b, count, detail);
    b->rays = rays;
    b->hits = hits;
    b->count = err ? 0 : count;
    for (uint32_t i = 0; i < b->count; i++) b->asking[i] = i;
    for (b->looks = 0; !err && b->count > 0 && b->looks < LOOKS_MOST; b->looks++) {
        bd_slicer_work(context->slicer, "points beside");
        err = bd_receivers_each(context, (b->count + BD_LANES - 1) / BD_LANES,
                                UNITS_PER_SEARCH * BD_LANES, look_in_group, b);
        if (!err)
            err = bd_visibility_ask(context, b->visibility, b->segments, 2 * (size_t)b->count,
                                    b->hidden, traced, detail);
        if (!err) keep_hidden(b);
    }
    for (uint32_t k = 0; k < b->count; k++) b->near[b->asking[k]] = BD_BESIDE_HIDDEN;
    return err;
}
