#include "pass/caustic_photons.h"

#include <math.h>
#include <stdlib.h>

#include "kernel/all_channels.h"
#include "kernel/lift.h"
#include "kernel/light.h"
#include "lights/directions.h"
#include "lights/sequence.h"
#include "lights/surface_hits.h"
#include "pass/brushed.h"
#include "pass/f3_arrays.h"
#include "pass/landed.h"
#include "pass/nearest.h"
#include "pass/onward.h"
#include "pass/receivers.h"

// Photons that are on their way at once.
#define AT_ONCE 16384u
// Spheres that are aimed at; of more glass, several share one.
#define TARGETS_MAX 64u
// Brushed metal that a photon comes to and is told at; further walls of it tell nothing.
#define ON_WAY_MAX 4u
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_PHOTON 100.0
// Of the scene's radius: how far off photons still tell of a place.
#define REACH 0.25f
// Those that were sent once more count if they are more than one of so many that lamps sent: of
// fewer a place finds none that is near, and rays do as well.
#define LEAST_AGAIN 64u
// So many of them tell of a place together: what a diffuse surface sends through glass has no edges
// that are as sharp as a lamp's.
#define NEAR_AGAIN 64u
// Numbers that nobody else of a frame draws by its seed.
#define OF_WAY    0x63617573u
#define OF_START  0x63617574u
#define OF_TARGET 0x63617575u
// Of those that are sent once more.
#define OF_WAY_AGAIN    0x63617576u
#define OF_TARGET_AGAIN 0x63617577u

struct target {
    f3 centre;
    float radius;
};

// Where a photon lands, and what that sends on of it.
struct source {
    f3 position, normal, flux, diffuse; // `flux`: that comes there
    uint32_t triangle, number;
};

struct landed {
    struct bd_photon *photons;
    uint32_t count;
};

struct caustics {
    struct bd_pass_context context;
    const struct bd_caustic_photons_inputs *inputs;
    struct bd_surface_hits hits;
    struct target targets[TARGETS_MAX];
    uint32_t target_count;
    // Of lamps, punctual lights first: what they may send to the targets, summed up to and with
    // each.
    double *cumulated;
    uint32_t lamp_count;
    struct bd_sequence of_way, of_start, of_target, of_way_again, of_target_again;
    // Of those on their way.
    uint32_t first, at_once;
    struct bd_ray *rays;
    struct bd_ray_hit *met;
    struct bd_way *ways;
    uint32_t *numbers;
    f3 *flux;
    float *inverse_range;
    bool *is_met; // their lamps are
    // What came to brushed metal on the way: of each photon so many, and how many; which walls it
    // had met before the last of them.
    struct bd_photon (*on_way)[ON_WAY_MAX];
    uint32_t *on_way_count, *told_at;
    struct source *sources; // that those which landed are, if they are sent on
    uint32_t source_count;
    struct landed landed, again, *to; // `to`: those whose turn it is
    struct bd_err_detail *detail;
};

// --- what is aimed at ---------------------------------------------------------------------------

// The smallest about both that is easily told.
static struct target joined(struct target a, struct target b)
{
    const f3 between = f3_sub(b.centre, a.centre);
    const float distance = f3_length(between);
    if (distance + b.radius <= a.radius) return a;
    if (distance + a.radius <= b.radius) return b;
    const float radius = 0.5f * (distance + a.radius + b.radius);
    return (struct target){f3_add(a.centre, f3_scale(between, (radius - a.radius) / distance)),
                           radius};
}

static struct target sphere_of(const struct caustics *c, const struct bd_instance *instance,
                               const struct bd_primitive *primitive)
{
    const float *bounds[2] = {primitive->bounds_min, primitive->bounds_max};
    f3 corner[8], centre = f3_of(0, 0, 0);
    for (int i = 0; i < 8; i++) {
        const bd_dvec3 p = {bounds[i & 1][0], bounds[i >> 1 & 1][1], bounds[i >> 2][2]};
        const bd_dvec3 r =
            bd_render_from_world(&c->hits.space, bd_dmat4_point(&instance->world_from_mesh, p));
        corner[i] = f3_of((float)r.x, (float)r.y, (float)r.z);
        centre = f3_add(centre, f3_scale(corner[i], 0.125f));
    }
    float radius = 0;
    for (int i = 0; i < 8; i++) radius = f_max(radius, f3_length(f3_sub(corner[i], centre)));
    return (struct target){centre, 1.001f * radius + 1e-6f};
}

static void find_targets(struct caustics *c)
{
    const struct bd_triangle_order *order = &c->hits.order;
    const struct bd_scene *scene = c->inputs->snapshot;
    uint32_t found = 0;
    for (uint32_t r = 0; r < order->run_count; r++) {
        const struct bd_triangle_run *run = &order->runs[r];
        const struct bd_primitive *primitive =
            &scene->meshes[run->mesh]->primitives[run->primitive];
        const struct bd_material *material = &scene->materials[primitive->material];
        if (!bd_material_goes_on(material, c->hits.roughest)) continue;
        for (uint32_t i = 0; i < run->instance_count; i++, found++) {
            const struct bd_instance *instance =
                &scene->instances[order->instances[run->first_instance + i]];
            const struct target sphere = sphere_of(c, instance, primitive);
            struct target *to = &c->targets[found % TARGETS_MAX];
            *to = found < TARGETS_MAX ? sphere : joined(*to, sphere);
        }
    }
    c->target_count = found < TARGETS_MAX ? found : TARGETS_MAX;
}

// Cosine of half the angle of a target's cone as a point sees it; -1: the point is within.
static float cone_of(const struct target *target, f3 from, f3 *axis)
{
    const f3 way = f3_sub(target->centre, from);
    const float distance = f3_length(way);
    if (distance <= target->radius) {
        *axis = f3_of(0, 0, 1);
        return -1;
    }
    const float sine = target->radius / distance;
    *axis = f3_scale(way, 1 / distance);
    return f_sqrt(f_max(1 - sine * sine, 0));
}

// Solid angle of all cones together; what overlaps counts as often.
static float cones_sr(const struct caustics *c, f3 from)
{
    float sum = 0;
    f3 axis;
    for (uint32_t t = 0; t < c->target_count; t++)
        sum += 2 * F_PI * (1 - cone_of(&c->targets[t], from, &axis));
    return sum;
}

// How many cones hold a direction. Narrow ones round: at least the one that was aimed at does.
static float cones_about(const struct caustics *c, f3 from, f3 direction)
{
    float count = 0;
    f3 axis;
    for (uint32_t t = 0; t < c->target_count; t++) {
        const float cosine = cone_of(&c->targets[t], from, &axis);
        count += f3_dot(axis, direction) >= cosine ? 1 : 0;
    }
    return f_max(count, 1);
}

// A direction to a target, by their solid angles, and the solid angle that stands for it.
static f3 aim(const struct caustics *c, f3 from, float choice, const float number[2], float *sr)
{
    const float all = cones_sr(c, from);
    float passed = 0;
    f3 axis = f3_of(0, 0, 1);
    float cosine = -1;
    for (uint32_t t = 0; t < c->target_count; t++) {
        cosine = cone_of(&c->targets[t], from, &axis);
        passed += 2 * F_PI * (1 - cosine);
        if (choice * all < passed) break;
    }
    const struct bd_basis basis = bd_basis_of(axis);
    const f3 d =
        bd_from_basis(&basis, axis, bd_direction_at(1 - number[0] * (1 - cosine), number[1]));
    *sr = all / cones_about(c, from, d);
    return d;
}

// --- lamps --------------------------------------------------------------------------------------

static f3 ahead_of(const struct bd_light_uniform *punctual)
{
    return f3_from(&punctual->direction);
}

static float discs_area(const struct caustics *c)
{
    float sum = 0;
    for (uint32_t t = 0; t < c->target_count; t++)
        sum += F_PI * c->targets[t].radius * c->targets[t].radius;
    return sum;
}

static double sent_by_punctual(const struct caustics *c, const struct bd_light_uniform *punctual)
{
    const float most = strongest_channel(f3_from(&punctual->intensity));
    if (punctual->kind == BD_LIGHT_KIND_DIRECTIONAL) return (double)most * discs_area(c);
    return (double)most * cones_sr(c, f3_from(&punctual->position));
}

static double sent_by_emitter(const struct caustics *c, const struct bd_area_light *light)
{
    const f3 middle =
        f3_scale(f3_add(f3_add(light->corner[0], light->corner[1]), light->corner[2]), 1 / 3.0f);
    return (double)(c->inputs->from_cd_m2 * light->brightest * light->area) * cones_sr(c, middle);
}

static enum bd_err weigh_lamps(struct caustics *c)
{
    const struct bd_caustic_photons_inputs *in = c->inputs;
    const uint32_t emitters = in->emitters ? in->emitters->count : 0;
    double sum = 0;
    c->lamp_count = in->punctual_count + emitters;
    c->cumulated = malloc(((size_t)c->lamp_count + 1) * sizeof *c->cumulated);
    if (!c->cumulated)
        return bd_err_set(c->detail, BD_ERR_NO_MEMORY, "photons", "no memory for %u lamps",
                          c->lamp_count);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < c->lamp_count; i++) {
        sum += i < in->punctual_count
                   ? sent_by_punctual(c, &in->punctuals[i])
                   : sent_by_emitter(c, &in->emitters->lights[i - in->punctual_count]);
        c->cumulated[i] = sum;
        if (i % 256 == 0) err = bd_slicer_pause(c->context.slicer);
    }
    return err;
}

static double sent_by_all(const struct caustics *c)
{
    return c->lamp_count > 0 ? c->cumulated[c->lamp_count - 1] : 0;
}

// The first that is not before that place.
static uint32_t lamp_at(const struct caustics *c, double place)
{
    uint32_t low = 0, high = c->lamp_count - 1;
    while (low < high) {
        const uint32_t middle = (low + high) / 2;
        if (c->cumulated[middle] > place)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

// --- photons ------------------------------------------------------------------------------------

// A ray and what it carries for each photon that a lamp is expected to send.
struct start {
    struct bd_ray ray;
    f3 flux;
    float inverse_range;
};

static struct bd_ray ray_of(f3 from, f3 direction, uint32_t triangle)
{
    return (struct bd_ray){.origin = {from.x, from.y, from.z},
                           .from_triangle = triangle,
                           .direction = {direction.x, direction.y, direction.z},
                           .far = INFINITY};
}

static f3 across_disc(const struct target *target, f3 ahead, const float number[2])
{
    const struct bd_basis basis = bd_basis_of(ahead);
    const float radius = target->radius * f_sqrt(number[0]), turn = 2 * F_PI * number[1];
    return f3_add(target->centre,
                  bd_from_basis(&basis, ahead, f3_of(radius * cosf(turn), radius * sinf(turn), 0)));
}

static struct start start_parallel(const struct caustics *c,
                                   const struct bd_light_uniform *punctual, float choice,
                                   const float way[2])
{
    const float all = discs_area(c);
    const f3 ahead = ahead_of(punctual);
    float passed = 0;
    uint32_t t = 0;
    for (; t + 1 < c->target_count; t++) {
        passed += F_PI * c->targets[t].radius * c->targets[t].radius;
        if (choice * all < passed) break;
    }
    const f3 at = across_disc(&c->targets[t], ahead, way);
    float count = 0;
    for (uint32_t i = 0; i < c->target_count; i++) {
        const f3 off = f3_sub(at, c->targets[i].centre);
        const float along = f3_dot(off, ahead), r = c->targets[i].radius;
        count += f3_dot(off, off) - along * along <= r * r ? 1 : 0;
    }
    const f3 from = f3_sub(at, f3_scale(ahead, punctual->distance));
    return (struct start){ray_of(from, ahead, BD_NO_TRIANGLE),
                          f3_scale(f3_from(&punctual->intensity), all / f_max(count, 1)), 0};
}

static struct start start_at_punctual(const struct caustics *c,
                                      const struct bd_light_uniform *punctual, float choice,
                                      const float way[2])
{
    const f3 from = f3_from(&punctual->position);
    float sr;
    if (punctual->kind == BD_LIGHT_KIND_DIRECTIONAL)
        return start_parallel(c, punctual, choice, way);
    const f3 d = aim(c, from, choice, way, &sr);
    const float cone = punctual->kind == BD_LIGHT_KIND_SPOT
                           ? attenuation_of_cone(f3_dot(d, ahead_of(punctual)), punctual->cos_outer,
                                                 punctual->per_cosine)
                           : 1;
    return (struct start){ray_of(from, d, BD_NO_TRIANGLE),
                          f3_scale(f3_from(&punctual->intensity), sr * cone),
                          punctual->inverse_range};
}

static struct start start_at_emitter(const struct caustics *c, const struct bd_area_light *light,
                                     const float start[2], float choice, const float way[2])
{
    const float root = f_sqrt(start[0]), v = root * start[1], u = root * (1 - start[1]);
    const float a = 1 - u - v;
    const f3 *corner = light->corner;
    const f3 at =
        f3_add(f3_scale(corner[0], a), f3_add(f3_scale(corner[1], u), f3_scale(corner[2], v)));
    float sr;
    const f3 d = aim(c, at, choice, way, &sr);
    const float cosine = f3_dot(light->normal, d);
    const f3 radiance = bd_area_emission_chosen(
        c->inputs->emitters, light, a * light->u[0] + u * light->u[1] + v * light->u[2],
        a * light->v[0] + u * light->v[1] + v * light->v[2], d);
    const float lift = lift_of_segment(0, at, at);
    const f3 from = f3_add(at, f3_scale(light->normal, cosine < 0 ? -lift : lift));
    return (struct start){
        ray_of(from, d, light->triangle),
        f3_scale(radiance, c->inputs->from_cd_m2 * light->area * f_abs(cosine) * sr), 0};
}

static void set_out(const struct caustics *c, uint32_t i)
{
    const struct bd_caustic_photons_inputs *in = c->inputs;
    const uint32_t number = c->first + i;
    float way[2], start[2], choice[2];
    bd_sequence_pair(&c->of_way, number, way);
    bd_sequence_pair(&c->of_start, number, start);
    bd_sequence_pair(&c->of_target, number, choice);
    const double all = sent_by_all(c), step = all / in->count;
    const uint32_t lamp = lamp_at(c, (number + 0.5) * step);
    const double own = c->cumulated[lamp] - (lamp > 0 ? c->cumulated[lamp - 1] : 0);
    const struct start s =
        lamp < in->punctual_count
            ? start_at_punctual(c, &in->punctuals[lamp], choice[0], way)
            : start_at_emitter(c, &in->emitters->lights[lamp - in->punctual_count], start,
                               choice[0], way);
    c->rays[i] = s.ray;
    c->ways[i] = bd_way_begins;
    c->flux[i] = f3_scale(s.flux, (float)(step / own));
    c->inverse_range[i] = s.inverse_range;
    c->is_met[i] = lamp >= in->punctual_count;
    c->numbers[i] = number;
    c->on_way_count[i] = 0;
    c->told_at[i] = BD_NOT_TOLD;
}

static void set_out_group(void *user, uint32_t group)
{
    const struct caustics *c = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES && i < c->at_once; i++)
        set_out(c, i);
}

// --- once more ----------------------------------------------------------------------------------

static void keep_source(struct caustics *c, uint32_t i, const struct bd_photon *photon)
{
    const struct bd_ray_hit *hit = &c->met[i];
    const float cosine = f3_dot(photon->normal, photon->way);
    const f3 diffuse = bd_surface_hit_diffuse(&c->hits, hit->triangle, hit->u, hit->v,
                                              c->inputs->sends, f_max(cosine, 0));
    if (c->to != &c->landed || !(strongest_channel(diffuse) > 0)) return;
    c->sources[c->source_count++] = (struct source){
        photon->position, photon->normal, photon->flux, diffuse, hit->triangle, c->numbers[i]};
}

// A ray from a mirror meets the source, as it meets a lamp.
static void set_out_from(struct caustics *c, uint32_t i)
{
    const struct source *from = &c->sources[i];
    float way[2], choice[2], sr;
    bd_sequence_pair(&c->of_way_again, from->number, way);
    bd_sequence_pair(&c->of_target_again, from->number, choice);
    const f3 d = aim(c, from->position, choice[0], way, &sr);
    const float part = f_max(f3_dot(from->normal, d), 0) * sr / F_PI;
    // As often as much of it goes there (Russian roulette): what is left carries as much as it
    // came.
    const float chance = f_min(strongest_channel(from->diffuse) * part, 1);
    const bool goes = choice[1] < chance;
    const float lift = lift_of_segment(0, from->position, from->position);
    c->rays[i] = ray_of(f3_add(from->position, f3_scale(from->normal, lift)), d, from->triangle);
    c->ways[i] = bd_way_begins;
    c->flux[i] = goes ? f3_scale(f3_mul(from->flux, from->diffuse), part / chance) : f3_of(0, 0, 0);
    c->inverse_range[i] = 0;
    c->is_met[i] = true;
    c->numbers[i] = from->number;
    c->on_way_count[i] = 0;
    c->told_at[i] = BD_NOT_TOLD;
}

static void set_out_again(void *user, uint32_t group)
{
    struct caustics *c = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES && i < c->at_once; i++)
        set_out_from(c, i);
}

// --- flight -------------------------------------------------------------------------------------

// A lamp's range is that of its first leg.
static void leave_lamp(struct caustics *c, uint32_t i)
{
    c->flux[i] = f3_scale(c->flux[i], window_of_range(c->met[i].distance, c->inverse_range[i]));
}

static uint32_t landed_room(const struct caustics *c)
{
    const uint32_t count = c->inputs->count;
    return count < BD_PHOTONS_LANDED_MAX / (ON_WAY_MAX + 1) ? (ON_WAY_MAX + 1) * count
                                                            : BD_PHOTONS_LANDED_MAX;
}

// Whether the wall before was brushed metal.
static bool is_by_brushed(const struct caustics *c, uint32_t i, const struct bd_way *way)
{
    return c->told_at[i] != BD_NOT_TOLD && c->told_at[i] + 1 == way->events;
}

static void tell_on_way(void *user, uint32_t i, const struct bd_interface *at,
                        const struct bd_ray *ray, const struct bd_ray_hit *hit,
                        const struct bd_way *way)
{
    struct caustics *c = user;
    const bool is_by = is_by_brushed(c, i, way);
    const f3 flux = f3_mul(c->flux[i], way->weight);
    (void)hit;
    c->told_at[i] = way->events;
    if (way->straight || c->on_way_count[i] == ON_WAY_MAX) return;
    c->on_way[i][c->on_way_count[i]++] =
        (struct bd_photon){.position = at->position,
                           .normal = at->normal_geometric,
                           .flux = flux,
                           .way = f3_of(-ray->direction[0], -ray->direction[1], -ray->direction[2]),
                           .is_met = c->is_met[i],
                           .is_by_brushed = is_by};
}

// Each photon has its place where it lands.
static uint32_t on_way_room(const struct caustics *c)
{
    return landed_room(c) - c->inputs->count;
}

static void land(struct caustics *c, uint32_t i)
{
    struct landed *to = c->to;
    for (uint32_t k = 0; k < c->on_way_count[i]; k++)
        if (strongest_channel(c->on_way[i][k].flux) > 0 && to->count < on_way_room(c))
            to->photons[to->count++] = c->on_way[i][k];
    if (c->told_at[i] == c->ways[i].events) return;

    const struct bd_ray_hit *hit = &c->met[i];
    const float *d = c->rays[i].direction;
    struct bd_surface_point at;
    const f3 flux = f3_mul(c->flux[i], c->ways[i].weight);
    if (c->ways[i].straight || hit->triangle == BD_NO_TRIANGLE) return;
    if (!(strongest_channel(flux) > 0) ||
        !bd_surface_hit_at(&c->hits, hit->triangle, hit->u, hit->v, f3_of(d[0], d[1], d[2]), &at))
        return;
    const struct bd_photon photon = {.position = at.position,
                                     .normal = at.normal,
                                     .flux = f3_scale(flux, 1 / c->ways[i].rest),
                                     .way = f3_of(-d[0], -d[1], -d[2]),
                                     .is_met = c->is_met[i],
                                     .is_by_brushed = is_by_brushed(c, i, &c->ways[i])};
    to->photons[to->count++] = photon;
    if (c->sources) keep_source(c, i, &photon);
}

// What carries nothing need not fly.
static void close_ranks(struct caustics *c)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < c->at_once; i++) {
        if (!(strongest_channel(c->flux[i]) > 0)) continue;
        c->rays[kept] = c->rays[i];
        c->ways[kept] = c->ways[i];
        c->flux[kept] = c->flux[i];
        c->inverse_range[kept] = c->inverse_range[i];
        c->is_met[kept] = c->is_met[i];
        c->numbers[kept] = c->numbers[i];
        c->on_way_count[kept] = c->on_way_count[i];
        c->told_at[kept++] = c->told_at[i];
    }
    c->at_once = kept;
}

// Those that set out, until they land.
static enum bd_err let_fly(struct caustics *c, uint64_t seed)
{
    const struct bd_caustic_photons_inputs *in = c->inputs;
    struct bd_ray_counts traced = {0};
    const struct bd_onward_look look = {tell_on_way, c};
    enum bd_err err = bd_nearest_ask(&c->context, in->visibility, c->rays, c->at_once, c->met,
                                     &traced, c->detail);
    for (uint32_t i = 0; !err && i < c->at_once; i++) leave_lamp(c, i);
    if (!err)
        err =
            bd_onward_run(&c->context, &c->hits, in->visibility, BD_CARRIES_FLUX, seed, c->numbers,
                          c->rays, c->met, c->ways, c->at_once, &look, &traced, c->detail);
    for (uint32_t i = 0; !err && i < c->at_once; i++) land(c, i);
    return err;
}

static enum bd_err send(struct caustics *c, struct landed *to,
                        void (*set_out_those)(void *user, uint32_t group), uint64_t seed)
{
    c->to = to;
    bd_slicer_work(c->context.slicer, "caustic photons");
    const enum bd_err err = bd_receivers_each(&c->context, (c->at_once + BD_LANES - 1) / BD_LANES,
                                              UNITS_PER_PHOTON * BD_LANES, set_out_those, c);
    close_ranks(c);
    return err ? err : let_fly(c, seed);
}

// Those that land are sent on as they come, so that no more are kept than are on their way.
static enum bd_err send_and_again(struct caustics *c)
{
    const uint64_t seed = c->inputs->seed;
    c->source_count = 0;
    const enum bd_err err = send(c, &c->landed, set_out_group, seed ^ OF_WAY);
    if (err || c->source_count == 0) return err;
    c->at_once = c->source_count;
    return send(c, &c->again, set_out_again, seed ^ OF_WAY_AGAIN);
}

static enum bd_err make_room(struct caustics *c, bool goes_again)
{
    c->rays = malloc(AT_ONCE * sizeof *c->rays);
    c->met = malloc(AT_ONCE * sizeof *c->met);
    c->ways = malloc(AT_ONCE * sizeof *c->ways);
    c->numbers = malloc(AT_ONCE * sizeof *c->numbers);
    c->flux = malloc(AT_ONCE * sizeof *c->flux);
    c->inverse_range = malloc(AT_ONCE * sizeof *c->inverse_range);
    c->is_met = malloc(AT_ONCE * sizeof *c->is_met);
    c->landed.photons = malloc((landed_room(c) + (size_t)1) * sizeof *c->landed.photons);
    c->on_way = malloc(AT_ONCE * sizeof *c->on_way);
    c->on_way_count = malloc(AT_ONCE * sizeof *c->on_way_count);
    c->told_at = malloc(AT_ONCE * sizeof *c->told_at);
    if (goes_again) {
        c->again.photons = malloc((landed_room(c) + (size_t)1) * sizeof *c->again.photons);
        c->sources = malloc(AT_ONCE * sizeof *c->sources);
    }
    const bool has_again = !goes_again || (c->again.photons && c->sources);
    if (c->rays && c->met && c->ways && c->numbers && c->flux && c->inverse_range && c->is_met &&
        c->landed.photons && c->on_way && c->on_way_count && c->told_at && has_again)
        return BD_ERR_OK;
    return bd_err_set(c->detail, BD_ERR_NO_MEMORY, "photons", "no memory for %u photons",
                      c->inputs->count);
}

static enum bd_err make_map(struct caustics *c, const struct landed *landed, uint32_t near,
                            struct bd_photon_map **out)
{
    const struct bd_photon_map_how how = {.reach = REACH * (float)c->hits.space.radius,
                                          .near = near};
    return bd_landed_map(&c->context, c->inputs->snapshot,
                         c->inputs->visibility->alpha == BD_RAYS_ALPHA_COVERAGE, landed->photons,
                         landed->count, &how, out, c->detail);
}

static enum bd_err run(struct caustics *c, struct bd_photon_map **out, struct bd_photon_map **again)
{
    find_targets(c);
    enum bd_err err = c->target_count > 0 ? weigh_lamps(c) : BD_ERR_OK;
    const bool any = !err && sent_by_all(c) > 0 && isfinite(sent_by_all(c));
    if (any) err = make_room(c, again != NULL);
    for (c->first = 0; any && !err && c->first < c->inputs->count; c->first += AT_ONCE) {
        const uint32_t left = c->inputs->count - c->first;
        c->at_once = left < AT_ONCE ? left : AT_ONCE;
        err = send_and_again(c);
    }
    if (!err) err = make_map(c, &c->landed, 0, out);
    const bool matters = c->again.count > c->inputs->count / LEAST_AGAIN;
    return err || !again || !matters ? err : make_map(c, &c->again, NEAR_AGAIN, again);
}

enum bd_err bd_caustic_photons_run(const struct bd_pass_context *context,
                                   const struct bd_caustic_photons_inputs *inputs,
                                   struct bd_photon_map **out, struct bd_photon_map **again,
                                   struct bd_err_detail *detail)
{
    const uint32_t seed = (uint32_t)(inputs->seed ^ inputs->seed >> 32);
    struct caustics c = {.context = *context,
                         .inputs = inputs,
                         .of_way = bd_sequence_of(seed, OF_WAY),
                         .of_start = bd_sequence_of(seed, OF_START),
                         .of_target = bd_sequence_of(seed, OF_TARGET),
                         .of_way_again = bd_sequence_of(seed, OF_WAY_AGAIN),
                         .of_target_again = bd_sequence_of(seed, OF_TARGET_AGAIN),
                         .detail = detail};
    *out = NULL;
    if (again) *again = NULL;
    bd_surface_hits_init(&c.hits, inputs->snapshot);
    if (inputs->mirrors_alone) c.hits.roughest = BD_MIRROR_ROUGHNESS;
    const enum bd_err err = run(&c, out, again);
    bd_surface_hits_finish(&c.hits);
    free(c.cumulated);
    free(c.rays);
    free(c.met);
    free(c.ways);
    free(c.numbers);
    free(c.flux);
    free(c.inverse_range);
    free(c.is_met);
    free(c.landed.photons);
    free(c.again.photons);
    free(c.sources);
    free(c.on_way);
    free(c.on_way_count);
    free(c.told_at);
    return err;
}
