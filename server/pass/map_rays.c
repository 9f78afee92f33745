#include "pass/map_rays.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kernel/all_channels.h"
#include "kernel/hemi_octahedral.h"
#include "kernel/lift.h"
#include "kernel/map_rays.h"
#include "kernel/vpl_light.h"
#include "lights/sequence.h"
#include "pass/f3_arrays.h"
#include "pass/kernels.h"
#include "pass/nearest.h"

// Of rays and what they meet at once.
#define ROOM_BYTES ((size_t)16 << 20)
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_RAY 10.0
#define UNITS_PER_END 20.0
// Numbers that nobody else of a frame draws by its seed.
#define PURPOSE 0x6d617000u

// --- room ---------------------------------------------------------------------------------------

uint32_t bd_map_rays_at_once(const struct bd_point_gather_inputs *inputs)
{
    const struct bd_map_rays *r = NULL;
    const size_t each = sizeof *r->chosen + sizeof *r->which + sizeof *r->rays + sizeof *r->hits +
                        sizeof *r->numbers + sizeof *r->weights +
                        (inputs->glass ? sizeof *r->ways : 0);
    const size_t groups = ROOM_BYTES / (each * bd_map_ray_slots(inputs) * BD_LANES);
    return (uint32_t)(groups > 0 ? groups : 1) * BD_LANES;
}

enum bd_err bd_map_rays_begin(struct bd_map_rays *r, const struct bd_receiver_part *part,
                              struct bd_err_detail *detail)
{
    const size_t most = (size_t)part->group_count * BD_LANES * bd_map_ray_slots(r->inputs);
    if (!r->part) {
        bd_surface_hits_init(&r->surfaces, r->inputs->snapshot);
        r->surfaces.roughest = BD_MIRROR_ROUGHNESS;
        r->beside.points = &r->inputs->points->clusters;
        r->beside.visibility = r->inputs->visibility;
        r->beside.surfaces = &r->surfaces;
        r->chosen = malloc(most * sizeof *r->chosen);
        r->which = malloc(most * sizeof *r->which);
        r->first_ray = malloc((part->group_count + 1) * sizeof *r->first_ray);
        r->rays = malloc(most * sizeof *r->rays);
        r->hits = malloc(most * sizeof *r->hits);
        r->numbers = malloc(most * sizeof *r->numbers);
        r->weights = malloc(most * sizeof *r->weights);
        if (r->inputs->glass) r->ways = malloc(most * sizeof *r->ways);
    }
    r->part = part;
    if (!r->chosen || !r->which || !r->first_ray || !r->rays || !r->hits || !r->numbers ||
        !r->weights || (r->inputs->glass && !r->ways))
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "map_rays", "no memory for %zu", most);
    memset(r->chosen, 0, most * sizeof *r->chosen);
    return BD_ERR_OK;
}

void bd_map_rays_finish(struct bd_map_rays *r)
{
    void *rooms[] = {r->chosen, r->which,   r->first_ray, r->rays,
                     r->hits,   r->numbers, r->weights,   r->ways};
    if (r->part) bd_surface_hits_finish(&r->surfaces);
    bd_beside_finish(&r->beside);
    for (size_t i = 0; i < sizeof rooms / sizeof *rooms; i++) free(rooms[i]);
}

// --- which texels -------------------------------------------------------------------------------

static float size_of_texel(const struct bd_map_rays *r, uint32_t texel, f3 normal)
{
    return f_max(f3_dot(r->map->weight[texel], normal), 0);
}

// Of `count` in a line, `step` apart, the most of each and the two beside it.
static void take_most_beside(float *line, uint32_t step, uint32_t count)
{
    float before = 0, own = line[0];
    for (uint32_t i = 0; i < count; i++) {
        const float after = i + 1 < count ? line[(i + 1) * step] : 0;
        line[i * step] = f_max(own, f_max(before, after));
        before = own;
        own = after;
    }
}

static void take_most_about(float *gives, uint32_t side)
{
    for (uint32_t i = 0; i < side; i++) take_most_beside(gives + i * side, 1, side);
    for (uint32_t i = 0; i < side; i++) take_most_beside(gives + i, side, side);
}

void bd_map_rays_choose(const struct bd_map_rays *r, f3 normal, const uint32_t *seen, float *gives,
                        uint32_t by, struct bd_map_ray *chosen)
{
    const uint32_t side = r->map->side, texels = side * side, slots = bd_map_ray_slots(r->inputs);
    const float first = first_of_map(by);
    float sizes = 0, all_about = 0;
    uint32_t next = 0;
    take_most_about(gives, side);
    for (uint32_t t = 0; t < texels; t++) {
        sizes += size_of_texel(r, t, normal);
        all_about += gives[t];
    }
    for (uint32_t t = 0; t < texels; t++) {
        const float size = size_of_texel(r, t, normal);
        const float rays = rays_of_texel(r->inputs->rays, size, sizes, gives[t], all_about);
        const uint32_t drawn = drawn_of_texel(rays, t % side, t / side, first);
        for (uint32_t k = 0; k < drawn && next < slots; k++)
            chosen[next++] = (struct bd_map_ray){t, seen[t], 1 / rays, k};
    }
}

// --- where they go ------------------------------------------------------------------------------

struct receiver {
    uint32_t group, lane;
};

static struct receiver receiver_of(const struct bd_map_rays *r, uint32_t i)
{
    const uint32_t at = r->which[i] / bd_map_ray_slots(r->inputs);
    return (struct receiver){at / BD_LANES, at % BD_LANES};
}

static void list_rays(struct bd_map_rays *r)
{
    const uint32_t each = BD_LANES * bd_map_ray_slots(r->inputs);
    r->count = 0;
    for (uint32_t group = 0; group < r->part->group_count; group++) {
        r->first_ray[group] = r->count;
        for (uint32_t i = group * each; i < (group + 1) * each; i++)
            if (r->chosen[i].counts > 0) r->which[r->count++] = i;
    }
    r->first_ray[r->part->group_count] = r->count;
}

// Of the texel's by chance: in the map's axes, to the octahedron (kernel/hemi_octahedral.h).
static f3 way_of(const struct bd_map_rays *r, const struct bd_map_ray *chosen, uint32_t chance)
{
    const uint32_t side = r->map->side;
    const struct bd_sequence sequence = bd_sequence_of(chance + chosen->texel, PURPOSE);
    float numbers[2];
    bd_sequence_pair(&sequence, chosen->of_texel, numbers);
    const float u = (float)(chosen->texel % side) + numbers[0];
    const float v = (float)(chosen->texel / side) + numbers[1];
    return way_of_place(place_of_texel(u, (float)side), place_of_texel(v, (float)side));
}

// What a texel would have of solid angle if all of it were as it is there.
static float solid_angle_at(const struct bd_map_rays *r, f3 way)
{
    const float side = (float)r->map->side, length2 = f3_dot(way, way);
    return 2 / (side * side * length2 * f_sqrt(length2));
}

// Where two triangles meet, off the one that the receiver is not known to lie on.
static f3 lifted(const struct bd_map_rays *r, const struct bd_native_place *place)
{
    const float reach = bd_askers_reach(r->part->askers);
    return f3_add(place->position, f3_scale(place->normal, lift_of_segment(reach, place->position,
                                                                           place->position)));
}

static void aim_ray(const struct bd_map_rays *r, uint32_t i)
{
    const struct receiver of = receiver_of(r, i);
    const struct bd_ray_starts *starts = &r->part->starts[of.group];
    const struct bd_native_place place = bd_point_gather_place(r->inputs, starts, of.lane);
    const f3 from = lifted(r, &place);
    const struct bd_map_ray *chosen = &r->chosen[r->which[i]];
    r->numbers[i] = bd_stirred(bd_stirred(place.chance + chosen->texel) + chosen->of_texel);
    const f3 way = way_of(r, chosen, place.chance);
    const f3 d = from_axes(f3_unit(way), place.across, place.along, place.normal);
    r->weights[i] = f3_scale(d, solid_angle_at(r, way) * chosen->counts);
    r->rays[i] = (struct bd_ray){.origin = {from.x, from.y, from.z},
                                 .from_triangle = starts->triangle[of.lane],
                                 .direction = {d.x, d.y, d.z},
                                 .far = INFINITY};
    if (r->ways) r->ways[i] = bd_way_begins;
}

static void aim_group(void *user, uint32_t group)
{
    const struct bd_map_rays *r = user;
    for (uint32_t i = r->first_ray[group]; i < r->first_ray[group + 1]; i++) aim_ray(r, i);
}

static enum bd_err trace(const struct bd_pass_context *context, struct bd_map_rays *r,
                         struct bd_err_detail *detail)
{
    const struct bd_visibility_inputs *visibility = r->inputs->visibility;
    enum bd_err err =
        bd_nearest_ask(context, visibility, r->rays, r->count, r->hits, &r->traced, detail);
    if (err || !r->ways) return err;
    return bd_onward_run(context, &r->surfaces, visibility, BD_CARRIES_RADIANCE, r->inputs->seed,
                         r->numbers, r->rays, r->hits, r->ways, r->count, NULL, &r->traced, detail);
}

// --- what they bring ----------------------------------------------------------------------------

static f3 brought(const struct bd_map_rays *r, uint32_t i)
{
    const struct bd_lit_points *points = r->inputs->points;
    const float *d = r->rays[i].direction;
    const uint32_t near = r->beside.near[i];
    if (near >= BD_BESIDE_HIDDEN) return f3_of(0, 0, 0);
    const f3 sent = bd_lit_points_send(points, near, f3_of(-d[0], -d[1], -d[2]));
    return r->ways ? f3_mul(sent, r->ways[i].weight) : sent;
}

// Where the map has that.
static f3 shown(const struct bd_map_rays *r, const struct bd_map_ray *chosen, f3 position)
{
    if (chosen->seen == BD_SEES_NOTHING) return f3_of(0, 0, 0);
    return bd_lit_points_send_to(r->inputs->points, chosen->seen, position);
}

// Irradiance by a receiver's rays, and by the texels that they go through instead: of both halves;
// and the sums of their directions.
struct told {
    f3 brought[2], shown[2], way_brought, way_shown;
    double products, squares; // of what rays bring and what is shown; of that
};

// Rays whose points are all hidden count as the others do.
static float more_of_known(const struct bd_map_rays *r, f3 normal, uint32_t first, uint32_t end)
{
    float all = 0, known = 0;
    for (uint32_t i = first; i < end; i++) {
        const float size = f_max(f3_dot(r->weights[i], normal), 0);
        all += size;
        if (r->beside.near[i] != BD_BESIDE_HIDDEN) known += size;
    }
    return known > 0 ? all / known : 0;
}

static struct told tell(const struct bd_map_rays *r, f3 position, f3 normal, uint32_t first,
                        uint32_t end)
{
    struct told told = {0};
    const float more = more_of_known(r, normal, first, end);
    for (uint32_t i = first; i < end; i++) {
        if (r->beside.near[i] == BD_BESIDE_HIDDEN) continue;
        const struct bd_map_ray *chosen = &r->chosen[r->which[i]];
        const uint32_t half = r->which[i] % 2;
        const f3 weight = f3_scale(r->weights[i], more);
        const f3 brings = brought(r, i), shows = shown(r, chosen, position);
        const float size = f_max(f3_dot(weight, normal), 0);
        told.brought[half] = f3_add(told.brought[half], f3_scale(brings, size));
        told.shown[half] = f3_add(told.shown[half], f3_scale(shows, size));
        told.way_brought = f3_add(told.way_brought, f3_scale(weight, all_channels(brings)));
        told.way_shown = f3_add(told.way_shown, f3_scale(weight, all_channels(shows)));
        const double one = (double)(size * all_channels(brings));
        const double other = (double)(size * all_channels(shows));
        told.products += one * other;
        told.squares += other * other;
    }
    return told;
}

// How much of the map is right: so much of how far its texels that rays went through are off all
// of it counts. None of a map whose light no ray brings; and less where light would be below 0.
static float part_of_map(const struct told *told, f3 map)
{
    const f3 brings = f3_add(told->brought[0], told->brought[1]);
    const f3 more = f3_sub(f3_add(told->shown[0], told->shown[1]), map);
    float part = told->squares > 0 ? (float)(told->products / told->squares) : 0;
    part = f_min(f_max(part, 0), 1);
    if (part * more.x > brings.x) part = brings.x / more.x;
    if (part * more.y > brings.y) part = brings.y / more.y;
    if (part * more.z > brings.z) part = brings.z / more.z;
    return part;
}

static void correct(const struct bd_map_rays *r, uint32_t group, uint32_t lane, uint32_t first,
                    uint32_t end)
{
    struct bd_receiver_light *light = &r->part->light[group];
    const f3 normal = f3_at(&r->part->receivers[group].normal, lane);
    const f3 position = f3_at(&r->part->starts[group].position, lane);
    const struct told told = tell(r, position, normal, first, end);
    const f3 map = f3_at(&light->irradiance, lane), way = f3_at(&light->vector, lane);
    const float part = part_of_map(&told, map);
    f3 halves[2];
    for (uint32_t half = 0; half < 2; half++)
        halves[half] = f3_add(told.brought[half],
                              f3_scale(f3_sub(f3_scale(map, .5f), told.shown[half]), part));
    const f3 irradiance = f3_max(f3_add(halves[0], halves[1]), 0);
    const f3 directions = f3_add(told.way_brought, f3_scale(f3_sub(way, told.way_shown), part));
    f3_put_at(&light->irradiance, lane, irradiance);
    f3_put_at(&light->vector, lane, irradiance_vector(irradiance, directions, normal));
    f3_put_at(&light->noise, lane, f3_sub(halves[0], halves[1]));
}

// A receiver's rays lie side by side.
static void correct_group(void *user, uint32_t group)
{
    const struct bd_map_rays *r = user;
    uint32_t first = r->first_ray[group];
    while (first < r->first_ray[group + 1]) {
        const struct receiver of = receiver_of(r, first);
        uint32_t end = first + 1;
        while (end < r->first_ray[group + 1] && receiver_of(r, end).lane == of.lane) end++;
        correct(r, group, of.lane, first, end);
        first = end;
    }
}

enum bd_err bd_map_rays_run(const struct bd_pass_context *context, struct bd_map_rays *r,
                            struct bd_err_detail *detail)
{
    const uint32_t groups = r->part->group_count;
    list_rays(r);
    const double rays = groups > 0 ? (double)r->count / groups : 0;
    bd_slicer_work(context->slicer, "aim map rays");
    enum bd_err err = bd_receivers_each(context, groups, UNITS_PER_RAY * rays, aim_group, r);
    if (!err) err = trace(context, r, detail);
    if (!err)
        err = bd_beside_find(context, &r->beside, r->rays, r->hits, r->count, &r->traced, detail);
    bd_slicer_work(context->slicer, "map rays bring");
    if (!err) err = bd_receivers_each(context, groups, UNITS_PER_END * rays, correct_group, r);
    return err;
}
