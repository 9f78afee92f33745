#include "pass/cosine_rays.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kernel/lift.h"
#include "lights/directions.h"
#include "pass/f3_arrays.h"
#include "pass/lobe.h"
#include "pass/nearest.h"

#define HALVES BD_COSINE_HALVES
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_RAY 30.0
// Numbers that nobody else of a frame draws by its seed.
#define PURPOSE 0x66617200u

static size_t rays_of_group(const struct bd_cosine_rays *r)
{
    return (size_t)BD_LANES * r->of_receiver;
}

size_t bd_cosine_rays_bytes(const struct bd_cosine_rays *r)
{
    return rays_of_group(r) * (sizeof *r->rays + sizeof *r->hits + sizeof *r->lanes +
                               sizeof *r->numbers + (r->glass ? sizeof *r->ways : 0));
}

static enum bd_err make_room(struct bd_cosine_rays *r, uint32_t group_count,
                             struct bd_err_detail *detail)
{
    const size_t rays = group_count * rays_of_group(r);
    if (r->rays) return BD_ERR_OK;
    r->stride = bd_sequence_stride(r->of_receiver / HALVES);
    for (uint32_t half = 0; half < HALVES; half++)
        r->sequence[half] = bd_sequence_of(bd_askers_seed(r->seed), PURPOSE + half);
    r->rays = malloc(rays * sizeof *r->rays);
    r->hits = malloc(rays * sizeof *r->hits);
    r->lanes = malloc(rays * sizeof *r->lanes);
    r->numbers = malloc(rays * sizeof *r->numbers);
    r->ray_count = malloc(group_count * sizeof *r->ray_count);
    r->first_ray = malloc(group_count * sizeof *r->first_ray);
    if (r->glass) r->ways = malloc(rays * sizeof *r->ways);
    if (r->rays && r->hits && r->lanes && r->numbers && r->ray_count && r->first_ray &&
        (r->ways || !r->glass))
        return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "far_rays", "no memory for %zu rays", rays);
}

void bd_cosine_rays_finish(struct bd_cosine_rays *r)
{
    void *arrays[] = {r->rays, r->hits, r->ways, r->lanes, r->numbers, r->ray_count, r->first_ray};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
}

// --- where they go ------------------------------------------------------------------------------

static uint32_t place_of(const struct bd_receiver_part *part, uint32_t index)
{
    const struct bd_tile *tile = &part->slice.tile;
    if (!part->askers) return part->points[index].number;
    return bd_sequence_place(tile->x + index % tile->width, tile->y + index / tile->width, 1);
}

struct receiver {
    f3 position, normal, normal_geometric;
    struct bd_basis basis;
    uint32_t triangle, place;
};

// Where two triangles meet, off the one that the receiver is not known to lie on.
static f3 lifted(const struct bd_cosine_rays *r, const struct receiver *at)
{
    const float lift = lift_of_segment(r->view_reach, at->position, at->position);
    return f3_add(at->position, f3_scale(at->normal_geometric, lift));
}

// Whether a pixel shows glass.
static bool shows_glass(const struct bd_cosine_rays *r, uint32_t group, uint32_t lane,
                        struct bd_area_receiver *at, struct bd_interface *glass)
{
    return r->enters && bd_lobe_receiver_at(r->part, group, lane, at) &&
           bd_interface_seen_at(r->glass, at->triangle, at->position, at->viewer, glass);
}

// False where it would go into the surface.
static bool aim(const struct bd_cosine_rays *r, const struct receiver *at, uint32_t number,
                struct bd_ray *ray)
{
    float numbers[2];
    bd_sequence_pair(&r->sequence[number % HALVES], at->place * r->stride + number / HALVES,
                     numbers);
    const f3 d = bd_from_basis(&at->basis, at->normal, bd_cosine_direction(numbers));
    const f3 from = lifted(r, at);
    *ray = (struct bd_ray){.origin = {from.x, from.y, from.z},
                           .from_triangle = at->triangle,
                           .direction = {d.x, d.y, d.z},
                           .far = r->reach > 0 ? r->reach : INFINITY};
    return f3_dot(d, at->normal_geometric) > 0;
}

static bool shows_veil(const struct bd_cosine_rays *r, uint32_t triangle)
{
    if (!r->veils || triangle == BD_NO_TRIANGLE) return false;
    const int32_t material = bd_surface_hit_of(r->veils, triangle).primitive->material;
    return r->veils->scene->materials[material].alpha_mode == BD_ALPHA_BLEND;
}

// The same place on its other side.
static struct receiver rear_of(const struct receiver *at)
{
    struct receiver rear = *at;
    rear.normal = f3_scale(at->normal, -1);
    rear.normal_geometric = f3_scale(at->normal_geometric, -1);
    rear.basis = bd_basis_of(rear.normal);
    return rear;
}

// Rays of a receiver, from place `next` on; how many.
static size_t aim_all(const struct bd_cosine_rays *r, uint32_t group, uint32_t lane,
                      const struct receiver *at, size_t next)
{
    const size_t first = next;
    struct bd_area_receiver seen;
    struct bd_interface glass;
    const bool enters = shows_glass(r, group, lane, &seen, &glass);
    const struct receiver other = shows_veil(r, at->triangle) ? rear_of(at) : *at;
    for (uint32_t i = 0; i < r->of_receiver; i++) {
        r->lanes[next] = (uint8_t)(lane * HALVES + i % HALVES);
        r->numbers[next] = at->place * r->stride * HALVES + i;
        if (r->ways) r->ways[next] = bd_way_begins;
        next += enters && i % 2 == 1
                    ? bd_onward_enter(r->glass, &glass, seen.viewer, r->seed, r->numbers[next],
                                      &r->rays[next], &r->ways[next])
                    : aim(r, i % 2 == 1 ? &other : at, i, &r->rays[next]);
    }
    return next - first;
}

static void aim_group(void *user, uint32_t group)
{
    const struct bd_cosine_rays *r = user;
    const struct bd_receivers *receivers = &r->part->receivers[group];
    const struct bd_ray_starts *starts = &r->part->starts[group];
    const size_t first = group * rays_of_group(r);
    size_t next = first;
    for (uint32_t lane = 0; lane < BD_LANES && group * BD_LANES + lane < r->part->count; lane++) {
        struct receiver at = {.place = place_of(r->part, group * BD_LANES + lane)};
        if (receivers->lit[lane] == 0 || at.place % r->one_of != 0) continue;
        at.place /= r->one_of;
        at.position = f3_at(&starts->position, lane);
        if (r->needs_none && r->needs_none(r->user, at.position)) continue;
        at.normal = f3_at(&receivers->normal, lane);
        at.normal_geometric = f3_at(&starts->normal_geometric, lane);
        at.basis = bd_basis_of(at.normal);
        at.triangle = starts->triangle[lane];
        next += aim_all(r, group, lane, &at, next);
    }
    r->ray_count[group] = (uint32_t)(next - first);
}

_Static_assert(BD_LANES *HALVES <= 256, "a byte tells whose half a ray is of");

static void close_ranks(struct bd_cosine_rays *r)
{
    r->count = 0;
    for (uint32_t g = 0; g < r->part->group_count; g++) {
        const size_t from = g * rays_of_group(r);
        memmove(r->rays + r->count, r->rays + from, r->ray_count[g] * sizeof *r->rays);
        memmove(r->lanes + r->count, r->lanes + from, r->ray_count[g] * sizeof *r->lanes);
        memmove(r->numbers + r->count, r->numbers + from, r->ray_count[g] * sizeof *r->numbers);
        if (r->ways) memmove(r->ways + r->count, r->ways + from, r->ray_count[g] * sizeof *r->ways);
        r->first_ray[g] = r->count;
        r->count += r->ray_count[g];
    }
}

enum bd_err bd_cosine_rays_trace(const struct bd_pass_context *context, struct bd_cosine_rays *r,
                                 const struct bd_receiver_part *part,
                                 const struct bd_visibility_inputs *visibility,
                                 struct bd_err_detail *detail)
{
    r->part = part;
    r->view_reach = part->askers ? bd_askers_reach(part->askers) : 0;
    enum bd_err err = make_room(r, part->group_count, detail);
    bd_slicer_work(context->slicer, "cosine rays");
    const double units = UNITS_PER_RAY * (double)rays_of_group(r) / r->one_of;
    if (!err) err = bd_receivers_each(context, part->group_count, units, aim_group, r);
    if (err) return err;
    close_ranks(r);
    err = bd_nearest_ask(context, visibility, r->rays, r->count, r->hits, &r->traced, detail);
    if (err || !r->glass) return err;
    return bd_onward_run(context, r->glass, visibility, BD_CARRIES_RADIANCE, r->seed, r->numbers,
                         r->rays, r->hits, r->ways, r->count, NULL, &r->traced, detail);
}
