#include "pass/far.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "lights/surface_hits.h"
#include "pass/beside.h"
#include "pass/cosine_rays.h"
#include "pass/f3_arrays.h"
#include "pass/kernels.h"
#include "pass/screen.h"

#define HALVES BD_COSINE_HALVES
// Of rays and what they meet at once.
#define ROOM_BYTES ((size_t)16 << 20)
// Of the slicer, one for each evaluation of a VPL: what a ray takes to be told of.
#define UNITS_PER_HIT 100.0
// What points stand for a place.
#define UNITS_PER_PLACE 400.0
// Numbers that nobody else of a frame draws by its seed.
#define OF_ROULETTE 0x726f756cu
#define SIGHTS_LEAST 4096u
// Chance to ask for first light, in parts of it that are left out.
#define ROULETTE 4.0f

// A receiver's ray, and what part of it counts of what a place sends on.
struct asker {
    float share;
    uint32_t group, ray;
};

struct far {
    struct bd_pass_context context;
    struct bd_processor processor;
    const struct bd_far_inputs *inputs;
    struct bd_surface_hits surfaces;
    struct bd_sequence roulette;
    struct bd_cosine_rays rays;
    struct bd_beside ends; // cells that stand for those, where there are cells
    const struct bd_receiver_part *part;
    // Places that ask for their first light, as many of each group, and what that brings to whom.
    struct bd_surface_point *places;
    struct asker *askers;
    f3 *irradiance;
    float *cosine; // under which it comes there
    uint32_t *place_count, place_total;
    // Of each place the points that stand for it, and ways to those.
    struct bd_point_neighbours *near;
    struct bd_segment *ways;
    uint32_t *hidden;
    f3 *of_points; // that are the receivers, or NULL
    struct bd_err_detail *detail;
};

// --- room ---------------------------------------------------------------------------------------

static size_t rays_of_group(const struct far *f)
{
    return (size_t)BD_LANES * f->inputs->rays;
}

static uint32_t receivers_at_once(const struct far *f)
{
    const size_t group = bd_cosine_rays_bytes(&f->rays) +
                         rays_of_group(f) * (sizeof *f->places + sizeof *f->askers +
                                             sizeof *f->irradiance + sizeof *f->cosine);
    return (uint32_t)(ROOM_BYTES > group ? ROOM_BYTES / group : 1) * BD_LANES;
}

static enum bd_err make_room(struct far *f, uint32_t group_count)
{
    const size_t rays = group_count * rays_of_group(f);
    if (f->places) return BD_ERR_OK; // the first part is the largest
    f->places = malloc(rays * sizeof *f->places);
    f->askers = malloc(rays * sizeof *f->askers);
    f->irradiance = malloc(rays * sizeof *f->irradiance);
    f->cosine = malloc(rays * sizeof *f->cosine);
    f->place_count = malloc(group_count * sizeof *f->place_count);
    if (f->places && f->askers && f->irradiance && f->cosine && f->place_count) return BD_ERR_OK;
    return bd_err_set(f->detail, BD_ERR_NO_MEMORY, "far_rays", "no memory for %zu rays", rays);
}

// --- what rays bring ----------------------------------------------------------------------------

// What virtual lights leave out of light at a distance.
static float left_out(const struct far *f, float distance)
{
    const float area = f->inputs->area;
    return area > 0 ? area / (F_PI * distance * distance + area) : 0;
}

// What clamped ones do.
static float taken_off(const struct far *f, uint32_t group, uint32_t ray,
                       const struct bd_surface_point *at)
{
    const float *d = f->rays.rays[ray].direction, distance = f->rays.hits[ray].distance;
    const f3 direction = f3_of(d[0], d[1], d[2]);
    const f3 normal = f3_at(&f->part->receivers[group].normal, f->rays.lanes[ray] / HALVES);
    const float cosines = -f3_dot(normal, direction) * f3_dot(at->normal, direction);
    const float bound = f->inputs->clamp * distance * distance;
    return cosines > bound ? 1 - bound / cosines : 0;
}

static void add(const struct far *f, uint32_t group, uint8_t lane, f3 irradiance)
{
    struct bd_receiver_light *light = &f->part->light[group];
    f3_add_at(&light->irradiance, lane / HALVES, irradiance);
    f3_add_at(&light->noise, lane / HALVES,
              lane % HALVES == 0 ? irradiance : f3_scale(irradiance, -1));
}

// Where little is left out few places ask for their first light (Russian roulette).
static float pdf_of_asking(const struct far *f, uint32_t ray, float part)
{
    const float pdf = f_min(ROULETTE * part, 1);
    float number[2];
    bd_sequence_pair(&f->roulette, f->rays.numbers[ray], number);
    return number[0] < pdf ? pdf : 0;
}

// Whether it came through glass, where nobody else looks for light.
static bool came_through(const struct far *f, uint32_t ray)
{
    return f->rays.ways && f->rays.ways[ray].events > 0;
}

// For each unit of irradiance where the ray ends.
static f3 sent(const struct far *f, uint32_t ray, float cosine)
{
    const struct bd_ray_hit *hit = &f->rays.hits[ray];
    const f3 diffuse = bd_surface_hit_diffuse(&f->surfaces, hit->triangle, hit->u, hit->v,
                                              f->inputs->sends, cosine);
    return came_through(f, ray) ? f3_mul(f->rays.ways[ray].weight, diffuse) : diffuse;
}

// Of a place that a ray met, `part` of whose light is left out.
static void ask_first_light(const struct far *f, uint32_t group, uint32_t ray, float part,
                            float pdf, struct bd_surface_point *at)
{
    const uint32_t slot = f->rays.first_ray[group] + f->place_count[group]++;
    at->number = f->rays.numbers[ray];
    f->places[slot] = *at;
    f->askers[slot] = (struct asker){1 / (float)f->inputs->rays * part / pdf, group, ray};
}

// Rays from `first` on are of a receiver. Those whose cells are all hidden count as the others do.
static float more_of_known(const struct far *f, uint32_t first, uint32_t end)
{
    uint32_t hidden = 0;
    if (!f->inputs->cells) return 0;
    for (uint32_t i = first; i < end; i++) hidden += f->ends.near[i] == BD_BESIDE_HIDDEN;
    return hidden < f->inputs->rays ? (float)f->inputs->rays / (float)(f->inputs->rays - hidden)
                                    : 0;
}

static void add_cells(const struct far *f, uint32_t group, uint32_t ray, float part)
{
    const uint32_t cell = f->ends.near[ray];
    if (cell >= BD_BESIDE_HIDDEN) return;
    const f3 light = f->inputs->cells->irradiance[cell];
    add(f, group, f->rays.lanes[ray],
        f3_scale(f3_mul(sent(f, ray, BD_FROM_EVERYWHERE), light), part / (float)f->inputs->rays));
}

static void tell_clamped_ray(const struct far *f, uint32_t group, uint32_t ray, float more)
{
    const struct bd_ray_hit *hit = &f->rays.hits[ray];
    const float *d = f->rays.rays[ray].direction;
    struct bd_surface_point at;
    if (hit->triangle == BD_NO_TRIANGLE || !bd_surface_hit_at(&f->surfaces, hit->triangle, hit->u,
                                                              hit->v, f3_of(d[0], d[1], d[2]), &at))
        return;
    const float part = came_through(f, ray) ? 1 : taken_off(f, group, ray, &at);
    if (part == 0) return;
    const float pdf = pdf_of_asking(f, ray, part);
    if (f->inputs->cells) add_cells(f, group, ray, part * more);
    if (pdf > 0) ask_first_light(f, group, ray, part, pdf, &at);
}

static void tell_ray(const struct far *f, uint32_t group, uint32_t ray, float more)
{
    const struct bd_far_inputs *in = f->inputs;
    const struct bd_ray_hit *hit = &f->rays.hits[ray];
    const float *d = f->rays.rays[ray].direction;
    struct bd_surface_point at;
    if (hit->triangle == BD_NO_TRIANGLE) return;
    const float part = came_through(f, ray) ? 1 : left_out(f, hit->distance);
    const float pdf = pdf_of_asking(f, ray, part);
    if (in->cells) add_cells(f, group, ray, more);
    if (pdf > 0 && bd_surface_hit_at(&f->surfaces, hit->triangle, hit->u, hit->v,
                                     f3_of(d[0], d[1], d[2]), &at))
        ask_first_light(f, group, ray, part, pdf, &at);
}

// Of what came round by glass. A ray stands for pi over their number of its receiver's directions.
static void add_emission(const struct far *f, uint32_t group, uint32_t ray)
{
    const bool is_sky = f->rays.hits[ray].triangle == BD_NO_TRIANGLE;
    const bool sky_alone = f->inputs->caustics || f->inputs->glass == BD_GLASS_SHOWS_SKY;
    if (sky_alone && !is_sky) return;
    const f3 radiance = bd_onward_emission(f->inputs->first, &f->rays.rays[ray], &f->rays.hits[ray],
                                           &f->rays.ways[ray]);
    add(f, group, f->rays.lanes[ray], f3_scale(radiance, F_PI / (float)f->inputs->rays));
}

// Rays from `first` on are of a receiver; returns where the next one's begin.
static uint32_t tell_receiver(const struct far *f, uint32_t group, uint32_t first, uint32_t end)
{
    const uint8_t receiver = f->rays.lanes[first] / HALVES;
    uint32_t next = first;
    while (next < end && f->rays.lanes[next] / HALVES == receiver) next++;
    const float more = more_of_known(f, first, next);
    for (uint32_t i = first; i < next; i++) {
        if (f->rays.ways && !f->rays.ways[i].straight) add_emission(f, group, i);
        if (f->inputs->glass == BD_GLASS_SHOWS_SKY) continue;
        f->inputs->clamp > 0 ? tell_clamped_ray(f, group, i, more) : tell_ray(f, group, i, more);
    }
    return next;
}

static void tell_group(void *user, uint32_t group)
{
    const struct far *f = user;
    const uint32_t end = f->rays.first_ray[group] + f->rays.ray_count[group];
    f->place_count[group] = 0;
    for (uint32_t i = f->rays.first_ray[group]; i < end;) i = tell_receiver(f, group, i, end);
}

// Of all groups, side by side.
static uint32_t close_ranks(struct far *f)
{
    uint32_t count = 0;
    for (uint32_t g = 0; g < f->part->group_count; g++) {
        const uint32_t from = f->rays.first_ray[g];
        memmove(f->places + count, f->places + from, f->place_count[g] * sizeof *f->places);
        memmove(f->askers + count, f->askers + from, f->place_count[g] * sizeof *f->askers);
        count += f->place_count[g];
    }
    return count;
}

// From where the place is looked at: a point beyond a wall that stands on both does not count, nor
// one that faces away.
static struct bd_segment way_to(const struct far *f, const struct bd_ray *ray, uint32_t point)
{
    const struct bd_surface_point *at = &f->inputs->points->points.points[point];
    struct bd_segment way = {.from_triangle = ray->from_triangle,
                             .to = {at->position.x, at->position.y, at->position.z},
                             .to_triangle = at->triangle};
    memcpy(way.from, ray->origin, sizeof way.from);
    return way;
}

// A segment is not blocked by the triangles at its ends: both sides have to look at each other.
static bool face_each_other(const struct far *f, const struct asker *asker, uint32_t point)
{
    const struct bd_ray *ray = &f->rays.rays[asker->ray];
    const struct bd_surface_point *at = &f->inputs->points->points.points[point];
    const f3 from = f3_of(ray->origin[0], ray->origin[1], ray->origin[2]);
    const f3 way = f3_sub(at->position, from);
    const f3 normal = f3_at(&f->part->receivers[asker->group].normal_geometric,
                            f->rays.lanes[asker->ray] / HALVES);
    const bool is_ahead = came_through(f, asker->ray) || f3_dot(normal, way) > 0;
    return is_ahead && f3_dot(at->normal, way) < 0;
}

// That is among those of the receivers, or BD_NO_CELL.
static uint32_t cell_of(const struct far *f, uint32_t place)
{
    if (!f->inputs->sights) return BD_NO_CELL;
    const uint32_t cell = f->ends.near[f->askers[place].ray];
    return cell < BD_BESIDE_HIDDEN ? cell : BD_NO_CELL;
}

static void find_points(void *user, uint32_t group)
{
    const struct far *f = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES; i++) {
        struct bd_segment *ways = f->ways + (size_t)i * BD_IRRADIANCE_POINTS_ASKED;
        memset(ways, 0, BD_IRRADIANCE_POINTS_ASKED * sizeof *ways);
        if (i >= f->place_total || cell_of(f, i) != BD_NO_CELL) continue;
        const struct bd_ray *ray = &f->rays.rays[f->askers[i].ray];
        struct bd_point_neighbours *near = &f->near[i];
        bd_irradiance_points_find(f->inputs->points, f->places[i].position, f->places[i].normal,
                                  near);
        for (uint32_t k = 0; k < near->count; k++) {
            if (!face_each_other(f, &f->askers[i], near->point[k])) near->share[k] = 0;
            ways[k] = way_to(f, ray, near->point[k]);
        }
    }
}

static uint32_t hidden_of(const struct far *f, uint32_t place)
{
    const uint32_t bit = place * BD_IRRADIANCE_POINTS_ASKED;
    return f->hidden[bit / 32] >> bit % 32 & ((1u << BD_IRRADIANCE_POINTS_ASKED) - 1);
}

static uint32_t receiver_of(const struct far *f, uint32_t place)
{
    const struct asker *asker = &f->askers[place];
    const uint32_t lane = f->rays.lanes[asker->ray] / HALVES;
    return f->part->slice.first + asker->group * BD_LANES + lane;
}

// Where no point stands for the place, it is so near to the receiver that what comes to that will
// do.
static f3 light_of_points(const struct far *f, uint32_t place)
{
    f3 light;
    if (bd_irradiance_points_tell(f->inputs->points, &f->near[place], hidden_of(f, place), &light))
        return light;
    return f->of_points[receiver_of(f, place)];
}

static bool add_sight(const struct far *f, uint32_t place, uint32_t cell)
{
    struct bd_far_sights *s = f->inputs->sights;
    const struct asker *asker = &f->askers[place];
    if (s->count == s->room) {
        const uint32_t room = 2 * s->room + SIGHTS_LEAST;
        struct bd_far_sight *sights = realloc(s->sights, room * sizeof *sights);
        if (!sights) return false;
        s->sights = sights;
        s->room = room;
    }
    s->sights[s->count++] =
        (struct bd_far_sight){receiver_of(f, place), cell,
                              f3_scale(sent(f, asker->ray, BD_FROM_EVERYWHERE), asker->share)};
    return true;
}

// Beside first light: what is told later, or by points.
static bool add_further_light(struct far *f, uint32_t place)
{
    const uint32_t cell = cell_of(f, place);
    if (cell != BD_NO_CELL) return add_sight(f, place, cell);
    f->irradiance[place] = f3_add(f->irradiance[place], light_of_points(f, place));
    return true;
}

_Static_assert(32 % BD_IRRADIANCE_POINTS_ASKED == 0, "those of a place are bits of one word");

// Beside their first light.
static enum bd_err add_light_of_points(struct far *f)
{
    const uint32_t groups = (f->place_total + BD_LANES - 1) / BD_LANES;
    const size_t room = (size_t)groups * BD_LANES;
    enum bd_err err = BD_ERR_OK;
    f->near = malloc((room + 1) * sizeof *f->near);
    f->ways = malloc((room + 1) * BD_IRRADIANCE_POINTS_ASKED * sizeof *f->ways);
    f->hidden = malloc((room + 1) * BD_IRRADIANCE_POINTS_ASKED * sizeof *f->hidden / 8);
    if (!f->near || !f->ways || !f->hidden)
        err = bd_err_set(f->detail, BD_ERR_NO_MEMORY, "far_rays", "no memory for %zu ways", room);
    if (!err)
        err = bd_receivers_each(&f->context, groups, UNITS_PER_PLACE * BD_LANES, find_points, f);
    if (!err)
        err = bd_visibility_ask(&f->context, f->inputs->visibility, f->ways,
                                room * BD_IRRADIANCE_POINTS_ASKED, f->hidden, &f->rays.traced,
                                f->detail);
    for (uint32_t i = 0; !err && i < f->place_total; i++)
        if (!add_further_light(f, i))
            err = bd_err_set(f->detail, BD_ERR_NO_MEMORY, "cache_cells", "no memory for sights");
    free(f->near);
    free(f->ways);
    free(f->hidden);
    return err;
}

// A diffuse surface sees no focus in what another sends, and few rays would find one.
static f3 caustics_at(const struct far *f, uint32_t i)
{
    const struct bd_far_inputs *in = f->inputs;
    const struct bd_surface_point *place = &f->places[i];
    const uint32_t ray = f->askers[i].ray;
    const bool is_told = in->caustics_again && f->rays.ways && !f->rays.ways[ray].straight;
    if (!in->caustics || is_told) return f3_of(0, 0, 0);
    return bd_photon_map_look(in->caustics, place->position, place->normal,
                              BD_FAR_CAUSTICS_SPREAD * (float)f->surfaces.space.radius);
}

// What becomes of the irradiance of each place.
static void send_on(void *user, uint32_t group)
{
    const struct far *f = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES && i < f->place_total; i++) {
        f->irradiance[i] = f3_add(f->irradiance[i], caustics_at(f, i));
        f->irradiance[i] = f3_scale(
            f3_mul(f->irradiance[i], sent(f, f->askers[i].ray, f->cosine[i])), f->askers[i].share);
    }
}

static enum bd_err add_light_of_places(struct far *f)
{
    const struct bd_far_inputs *in = f->inputs;
    f->place_total = close_ranks(f);
    enum bd_err err = bd_first_light_run(&f->context, in->first, in->visibility, in->seed,
                                         f->places, f->place_total, NULL, f->irradiance, f->cosine,
                                         &f->rays.traced, f->detail);
    if (!err && in->points && f->place_total > 0) err = add_light_of_points(f);
    bd_slicer_work(f->context.slicer, "far");
    if (!err)
        err = bd_receivers_each(&f->context, (f->place_total + BD_LANES - 1) / BD_LANES,
                                UNITS_PER_HIT * BD_LANES, send_on, f);
    for (uint32_t i = 0; !err && i < f->place_total; i++)
        add(f, f->askers[i].group, f->rays.lanes[f->askers[i].ray], f->irradiance[i]);
    return err;
}

static enum bd_err light_part(void *user, const struct bd_receiver_part *part)
{
    struct far *f = user;
    f->part = part;
    enum bd_err err = make_room(f, part->group_count);
    if (!err)
        err = bd_cosine_rays_trace(&f->context, &f->rays, part, f->inputs->visibility, f->detail);
    if (!err && f->ends.cells)
        err = bd_beside_find(&f->context, &f->ends, f->rays.rays, f->rays.hits, f->rays.count,
                             &f->rays.traced, f->detail);
    bd_slicer_work(f->context.slicer, "far");
    if (!err)
        err = bd_receivers_each(&f->context, part->group_count, UNITS_PER_HIT * rays_of_group(f),
                                tell_group, f);
    if (!err) err = add_light_of_places(f);
    if (!err && f->of_points) bd_receivers_keep(part, f->of_points);
    return err;
}

// The screen has what rays would find.
static bool screen_is_enough(const void *user, f3 position)
{
    const struct bd_far_inputs *in = user;
    return bd_screen_holds_about(in->screen, position, 1 / sqrtf(in->clamp));
}

// --- the pass -----------------------------------------------------------------------------------

static enum bd_err run(const struct bd_pass_context *context, const struct bd_far_inputs *inputs,
                       struct bd_receivers_inputs *receivers, f3 *of_points,
                       struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    struct far f = {
        .context = *context,
        .processor = {inputs->visibility->pool, NULL},
        .inputs = inputs,
        .roulette = bd_sequence_of(bd_askers_seed(inputs->seed), OF_ROULETTE),
        .rays = {.of_receiver = inputs->rays,
                 .seed = inputs->seed,
                 .one_of = 1,
                 .reach = inputs->clamp > 0 && !inputs->glass ? 1 / sqrtf(inputs->clamp) : 0,
                 .needs_none = inputs->screen ? screen_is_enough : NULL,
                 .user = inputs},
        .ends = {.cells = inputs->sights ? inputs->sights->cells : inputs->cells,
                 .visibility = inputs->visibility,
                 .surfaces = &f.surfaces},
        .of_points = of_points,
        .detail = detail,
    };
    f.context.processor = &f.processor;
    f.rays.glass = inputs->glass ? &f.surfaces : NULL;
    receivers->starts = true;
    receivers->seed = inputs->seed;
    receivers->receivers_max = receivers_at_once(&f);
    receivers->light = light_part;
    receivers->user = &f;
    bd_surface_hits_init(&f.surfaces, inputs->snapshot);
    const enum bd_err err = bd_receivers_run(&f.context, receivers, detail);
    bd_ray_counts_add(traced, f.rays.traced);
    bd_surface_hits_finish(&f.surfaces);
    bd_cosine_rays_finish(&f.rays);
    bd_beside_finish(&f.ends);
    free(f.places);
    free(f.askers);
    free(f.irradiance);
    free(f.cosine);
    free(f.place_count);
    return err;
}

static void bind_outputs(const void *user, struct bd_bindings *bindings)
{
    const struct bd_indirect *out = user;
    bd_bind_image(bindings, 0, out->irradiance, true, true);
    bd_bind_image(bindings, 2, out->noise, true, true);
}

enum bd_err bd_far_run(const struct bd_pass_context *context, const struct bd_far_inputs *inputs,
                       const struct bd_gather_inputs *gather, struct bd_indirect *indirect,
                       struct bd_err_detail *detail)
{
    struct bd_receivers_inputs receivers = {
        .askers = bd_gather_askers(gather),
        .pass = "far",
        .noise = true,
        .adds = true,
        .bind = bind_outputs,
        .out = indirect,
    };
    return run(context, inputs, &receivers, NULL, &indirect->rays, detail);
}

static void bind_fragments(const void *user, struct bd_bindings *bindings)
{
    const struct bd_multires_light *out = user;
    struct bd_tex *const images[] = {out->fine, out->coarse,     NULL,
                                     NULL,      out->fine_noise, out->coarse_noise};
    for (uint32_t i = 0; i < sizeof images / sizeof *images; i++)
        if (images[i]) bd_bind_image(bindings, i, images[i], true, true);
}

enum bd_err bd_far_of_fragments(const struct bd_pass_context *context,
                                const struct bd_far_inputs *inputs,
                                const struct bd_gather_fragments_inputs *gather,
                                struct bd_multires_light *light, struct bd_err_detail *detail)
{
    struct bd_receivers_inputs receivers = {
        .askers = bd_fragment_askers(gather),
        .pass = "far",
        .noise = light->fine_noise != NULL,
        .adds = true,
        .bind = bind_fragments,
        .out = light,
    };
    return run(context, inputs, &receivers, NULL, &light->rays, detail);
}

enum bd_err bd_far_of_points(const struct bd_pass_context *context,
                             const struct bd_far_inputs *inputs,
                             const struct bd_surface_point *points, uint32_t count, f3 *irradiance,
                             struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    struct bd_receivers_inputs receivers = {.points = points, .point_count = count};
    return run(context, inputs, &receivers, irradiance, traced, detail);
}
