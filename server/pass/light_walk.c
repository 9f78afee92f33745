#include "pass/light_walk.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kernel/all_channels.h"
#include "kernel/light.h"
#include "lights/directions.h"
#include "lights/point_tree.h"
#include "lights/sequence.h"
#include "lights/surface_hits.h"
#include "pass/emitter_photons.h"
#include "pass/nearest.h"
#include "pass/onward.h"
#include "pass/punctual_photons.h"
#include "pass/receivers.h"

// Photons that are on their way at once.
#define AT_ONCE 8192u
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_ARRIVAL 200.0
// Of the flux that set out.
#define LEFT_OUT (1.0 / 8192)
// Of the first round.
#define PHOTONS_PER_POINT 1.0
// Points that take a photon, if either is seen from where it came. Else all that are near are
// asked: a ninth of the rays, and where points are many, no less even.
#define TAKERS_FIRST 2u
// Numbers that no round draws.
#define OF_EMITTERS 0x656d6974u
#define OF_ROULETTE 0x6c6f7400u
#define OF_TURNS    0x7475726eu
#define OF_GLASS    0x676c6173u
// A round of few is as cheap as one of fewer.
#define PHOTONS_LEAST 1024u

// The tree is made anew when so many points are not in it.
#define MAY_BE_NEW(points) ((points) / 32)

struct photon {
    f3 flux;
    f3 normal; // of the surface it left; 0 of a punctual light
    float inverse_range;
    bool is_parallel; // to all others of its light
    bool lands;       // on a surface that sends light on
};

struct walk {
    struct bd_pass_context context;
    const struct bd_light_walk_inputs *inputs;
    struct bd_surface_hits hits;
    struct bd_point_tree tree;
    uint32_t at_first, in_tree, points_max;
    uint32_t round; // 0: from the punctual lights
    // Of those on their way.
    uint32_t at_once;
    struct bd_ray *rays;
    struct photon *photons;
    struct bd_ray_hit *met;
    struct bd_way *ways; // with glass; else NULL, as are the photons' numbers
    uint32_t *numbers, sent_count;
    struct bd_point_neighbours *taken_by;
    // Of those whose takers are looked for: which photons, of how many points each, and segments
    // from where it set out to each of those.
    uint32_t *sought, sought_count, takers_most;
    struct bd_segment *segments;
    uint32_t *occluded;
    // Of all points: flux that arrived in this round; straight from lights, but through glass; that
    // is sent on in the next.
    f3 *arrived, *through, *sent;
    struct bd_err_detail *detail;
};

// --- a round's photons --------------------------------------------------------------------------

// Whether who is to take photon `i` and the surface that sent it face each other: a segment is not
// blocked by the triangles at its ends.
static bool face_each_other(const struct walk *w, uint32_t i, uint32_t taker)
{
    const struct bd_ray *ray = &w->rays[i];
    const struct bd_surface_point *point = &w->inputs->points->points[taker];
    const f3 from = f3_of(ray->origin[0], ray->origin[1], ray->origin[2]);
    const f3 d = f3_of(ray->direction[0], ray->direction[1], ray->direction[2]);
    const f3 way = w->photons[i].is_parallel ? d : f3_sub(point->position, from);
    const f3 sent_by = w->photons[i].normal;
    const bool is_ahead = f3_dot(sent_by, sent_by) == 0 || f3_dot(sent_by, way) > 0;
    return is_ahead && f3_dot(point->normal, way) < 0;
}

// Whether the place from which it came sees that.
static struct bd_segment way_to(const struct walk *w, uint32_t i, uint32_t taker)
{
    const struct bd_ray *ray = &w->rays[i];
    const struct bd_surface_point *point = &w->inputs->points->points[taker];
    const f3 to = point->position;
    struct bd_segment way = {.from_triangle = ray->from_triangle,
                             .to = {to.x, to.y, to.z},
                             .to_triangle = point->triangle};
    for (int c = 0; c < 3; c++)
        way.from[c] = w->photons[i].is_parallel ? way.to[c] - ray->direction[c] * w->met[i].distance
                                                : ray->origin[c];
    return way;
}

static void find_takers_of(const struct walk *w, uint32_t slot)
{
    const uint32_t i = w->sought[slot];
    const struct bd_ray_hit *hit = &w->met[i];
    const float *d = w->rays[i].direction;
    struct bd_point_neighbours *by = &w->taken_by[i];
    struct bd_surface_point at;
    by->count = 0;
    w->photons[i].lands =
        hit->triangle != BD_NO_TRIANGLE &&
        bd_surface_hit_at(&w->hits, hit->triangle, hit->u, hit->v, f3_of(d[0], d[1], d[2]), &at);
    if (!w->photons[i].lands) return;
    bd_point_tree_find(&w->tree, at.position, at.normal, w->takers_most, by);
    for (uint32_t k = 0; k < by->count; k++) {
        if (!face_each_other(w, i, by->point[k])) by->share[k] = 0;
        w->segments[slot * w->takers_most + k] = way_to(w, i, by->point[k]);
    }
}

static void find_takers(void *user, uint32_t group)
{
    const struct walk *w = user;
    for (uint32_t slot = group * BD_LANES; slot < (group + 1) * BD_LANES; slot++) {
        memset(w->segments + slot * w->takers_most, 0, w->takers_most * sizeof *w->segments);
        if (slot < w->sought_count) find_takers_of(w, slot);
    }
}

// What lies below another surface, or round a corner, gives its share to the others. False where
// none of them is seen: then nobody takes anything, for the nearest may be within a closed box that
// stands there.
static bool share_among_seen(const struct walk *w, uint32_t slot, struct bd_point_neighbours *by)
{
    float seen = 0;
    for (uint32_t k = 0; k < by->count; k++) {
        const uint32_t bit = slot * w->takers_most + k;
        if (w->occluded[bit / 32] >> bit % 32 & 1) by->share[k] = 0;
        seen += by->share[k];
    }
    for (uint32_t k = 0; k < by->count && seen > 0; k++) by->share[k] /= seen;
    return seen > 0;
}

// Of the photons that are sought; those remain that nobody takes of so many points.
static enum bd_err ask_takers(struct walk *w, uint32_t takers_most)
{
    const uint32_t groups = (w->sought_count + BD_LANES - 1) / BD_LANES;
    struct bd_ray_counts traced = {0};
    w->takers_most = takers_most;
    bd_slicer_work(w->context.slicer,
                   takers_most == TAKERS_FIRST ? "photons taken" : "photons left");
    enum bd_err err =
        bd_receivers_each(&w->context, groups, UNITS_PER_ARRIVAL * BD_LANES, find_takers, w);
    if (!err)
        err = bd_visibility_ask(&w->context, &w->inputs->visibility, w->segments,
                                (size_t)groups * BD_LANES * takers_most, w->occluded, &traced,
                                w->detail);
    if (err) return err;
    uint32_t left = 0;
    for (uint32_t slot = 0; slot < w->sought_count; slot++) {
        struct bd_point_neighbours *by = &w->taken_by[w->sought[slot]];
        if (by->count > 0 && !share_among_seen(w, slot, by)) w->sought[left++] = w->sought[slot];
    }
    w->sought_count = left;
    return BD_ERR_OK;
}

static enum bd_err find_who_takes(struct walk *w)
{
    for (uint32_t i = 0; i < w->at_once; i++) w->sought[i] = i;
    w->sought_count = w->at_once;
    enum bd_err err = ask_takers(w, TAKERS_FIRST);
    return err || w->sought_count == 0 ? err : ask_takers(w, BD_POINT_NEIGHBOURS);
}

// Whose light it is that arrives: first light has its own lists, which nobody behind glass asks.
static f3 *arrived_of(struct walk *w, uint32_t i)
{
    const bool is_apart = w->round == 0 && w->ways && !w->inputs->caustics_are_first;
    return is_apart && !w->ways[i].straight ? w->through : w->arrived;
}

// Where photon `i` landed.
static void add_point(struct walk *w, uint32_t i, f3 flux)
{
    struct bd_surface_points *points = w->inputs->points;
    const struct bd_ray_hit *hit = &w->met[i];
    const float *d = w->rays[i].direction;
    struct bd_surface_point *point = &points->points[points->count];
    if (points->count == w->points_max ||
        !bd_surface_hit_at(&w->hits, hit->triangle, hit->u, hit->v, f3_of(d[0], d[1], d[2]), point))
        return;
    point->diffuse = bd_surface_hit_sent(&w->hits, hit->triangle, hit->u, hit->v, w->inputs->sends,
                                         BD_FROM_EVERYWHERE);
    arrived_of(w, i)[points->count++] = flux;
}

// In the order of the photons, whichever thread found where they go.
static void give(struct walk *w)
{
    for (uint32_t i = 0; i < w->at_once; i++) {
        const struct photon *photon = &w->photons[i];
        const struct bd_point_neighbours *by = &w->taken_by[i];
        const float window = window_of_range(w->met[i].distance, photon->inverse_range);
        const float falls = window / (w->ways ? w->ways[i].rest : 1);
        float taken = 0;
        for (uint32_t k = 0; k < by->count; k++) {
            f3 *to = &arrived_of(w, i)[by->point[k]];
            *to = f3_add(*to, f3_scale(photon->flux, falls * by->share[k]));
            taken += by->share[k];
        }
        if (photon->lands && !(taken > 0)) add_point(w, i, f3_scale(photon->flux, falls));
    }
}

// A light's range is that of its first leg.
static void leave_glass(struct walk *w, uint32_t i)
{
    struct photon *photon = &w->photons[i];
    if (w->ways[i].events == 0) return;
    *photon = (struct photon){.flux = f3_mul(photon->flux, w->ways[i].weight)};
}

static enum bd_err go_on(struct walk *w)
{
    struct bd_ray_counts traced = {0};
    for (uint32_t i = 0; i < w->at_once; i++) {
        w->ways[i] = bd_way_begins;
        w->ways[i].weight = f3_scale(
            w->ways[i].weight, window_of_range(w->met[i].distance, w->photons[i].inverse_range));
        w->numbers[i] = w->sent_count++;
    }
    const enum bd_err err = bd_onward_run(
        &w->context, &w->hits, &w->inputs->visibility, BD_CARRIES_FLUX, w->inputs->seed ^ OF_GLASS,
        w->numbers, w->rays, w->met, w->ways, w->at_once, NULL, &traced, w->detail);
    for (uint32_t i = 0; !err && i < w->at_once; i++) leave_glass(w, i);
    return err;
}

static enum bd_err let_fly(struct walk *w)
{
    struct bd_ray_counts traced = {0};
    enum bd_err err = bd_nearest_ask(&w->context, &w->inputs->visibility, w->rays, w->at_once,
                                     w->met, &traced, w->detail);
    if (!err && w->ways) err = go_on(w);
    if (!err) err = find_who_takes(w);
    if (!err) give(w);
    w->at_once = 0;
    return err;
}

static enum bd_err set_out(struct walk *w, struct bd_ray ray, struct photon photon)
{
    w->rays[w->at_once] = ray;
    w->photons[w->at_once] = photon;
    return ++w->at_once == AT_ONCE ? let_fly(w) : BD_ERR_OK;
}

// --- from the punctual lights --------------------------------------------------------------------

static double flux_of_punctuals(const struct bd_light_walk_inputs *inputs)
{
    double sum = 0;
    for (uint32_t i = 0; i < inputs->punctual_count; i++)
        sum += strongest_channel(bd_punctual_flux(&inputs->punctuals[i]));
    return sum;
}

static enum bd_err shine(struct walk *w, const struct bd_light_uniform *punctual, double of_all)
{
    const struct bd_sequence sequence = bd_sequence_of(w->inputs->seed, w->round);
    const f3 flux = bd_punctual_flux(punctual);
    const double share = of_all > 0 ? strongest_channel(flux) / of_all : 0;
    const uint32_t count = (uint32_t)fmax(round(share * w->at_first), 1);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && share > 0 && i < count; i++) {
        float number[2];
        bd_sequence_pair(&sequence, i, number);
        err = set_out(w, bd_punctual_ray(punctual, number),
                      (struct photon){f3_scale(flux, 1 / (float)count), f3_of(0, 0, 0),
                                      punctual->inverse_range,
                                      punctual->kind == BD_LIGHT_KIND_DIRECTIONAL, false});
    }
    return err;
}

static enum bd_err shine_of_emitters(struct walk *w)
{
    struct bd_emitter_photons photons = bd_emitter_photons_of(
        w->inputs->emitters, w->at_first, w->inputs->from_cd_m2, w->inputs->seed, OF_EMITTERS);
    struct bd_ray ray;
    f3 flux, normal;
    enum bd_err err = BD_ERR_OK;
    while (!err && bd_emitter_photons_next(&photons, &ray, &flux, &normal))
        err = set_out(w, ray, (struct photon){flux, normal, 0, false, false});
    return err;
}

static enum bd_err shine_all(struct walk *w)
{
    const double of_all = flux_of_punctuals(w->inputs);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < w->inputs->punctual_count; i++)
        err = shine(w, &w->inputs->punctuals[i], of_all);
    if (!err) err = shine_of_emitters(w);
    return err || w->at_once == 0 ? err : let_fly(w);
}

// --- from the points ----------------------------------------------------------------------------

static double flux_sent(const struct walk *w)
{
    double sum = 0;
    for (uint32_t i = 0; i < w->inputs->points->count; i++) sum += strongest_channel(w->sent[i]);
    return sum;
}

static struct bd_ray ray_from(const struct bd_surface_point *point, const float number[2])
{
    const f3 at = point->position;
    const struct bd_basis basis = bd_basis_of(point->normal);
    const f3 d = bd_from_basis(&basis, point->normal, bd_cosine_direction(number));
    return (struct bd_ray){.origin = {at.x, at.y, at.z},
                           .from_triangle = point->triangle,
                           .direction = {d.x, d.y, d.z},
                           .far = INFINITY};
}

// What points draw in a round: by their own numbers, so that nothing that happens elsewhere changes
// it.
struct draws {
    struct bd_sequence roulette, ways, turns;
};

static struct draws draws_of(const struct walk *w)
{
    const uint32_t seed = w->inputs->seed;
    return (struct draws){bd_sequence_of(seed, w->round ^ OF_ROULETTE),
                          bd_sequence_of(seed, w->round),
                          bd_sequence_of(seed, w->round ^ OF_TURNS)};
}

// A point's photons: as many as it expects, the part of one by lot.
static uint32_t photons_of(const struct draws *draws, uint32_t point, double expected)
{
    float number[2];
    bd_sequence_pair(&draws->roulette, point, number);
    return (uint32_t)(expected + number[0]);
}

// Even over neighbouring points, and over the photons of each (Cranley and Patterson 1976).
static void draw_way(const struct draws *draws, uint32_t point, uint32_t photon, float way[2])
{
    float turn[2];
    bd_sequence_pair(&draws->ways, point, way);
    bd_sequence_pair(&draws->turns, photon, turn);
    for (int c = 0; c < 2; c++) way[c] += turn[c] - (way[c] + turn[c] >= 1 ? 1 : 0);
}

// `flux`: of all that is sent, in photons of about `step`, so many that the whole is right.
static enum bd_err send_on(struct walk *w, double flux, double step)
{
    const struct draws draws = draws_of(w);
    const uint32_t count = w->inputs->points->count;
    double photons = 0;
    for (uint32_t i = 0; i < count; i++)
        photons += photons_of(&draws, i, strongest_channel(w->sent[i]) / step);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < count; i++) {
        const struct bd_surface_point *point = &w->inputs->points->points[i];
        const float most = strongest_channel(w->sent[i]);
        const uint32_t own = photons_of(&draws, i, most / step);
        const f3 carried = f3_scale(w->sent[i], (float)(flux / photons / most));
        for (uint32_t k = 0; !err && k < own; k++) {
            float way[2];
            draw_way(&draws, i, k, way);
            err = set_out(w, ray_from(point, way),
                          (struct photon){carried, point->normal, 0, false, false});
        }
    }
    return err || w->at_once == 0 ? err : let_fly(w);
}

// What arrived is sent on, and told.
static void reflect(struct walk *w, f3 *told)
{
    const struct bd_surface_points *points = w->inputs->points;
    for (uint32_t i = 0; i < points->count; i++) {
        w->sent[i] = f3_mul(points->points[i].diffuse, w->arrived[i]);
        told[i] = f3_add(told[i], f3_scale(w->arrived[i], 1 / points->area));
        w->arrived[i] = f3_of(0, 0, 0);
    }
}

static void take_through(struct walk *w, struct bd_lit_points *lit, uint32_t i)
{
    const float area = w->inputs->points->area;
    if (lit->behind && i < w->at_first)
        w->through[i] = f3_add(w->through[i], f3_scale(lit->behind[i], area));
    lit->further[i] = f3_scale(w->through[i], 1 / area);
    w->arrived[i] = f3_add(w->arrived[i], w->through[i]);
}

// Of the punctual lights' light, and of what others bring.
static void reflect_first(struct walk *w, struct bd_lit_points *lit)
{
    const struct bd_surface_points *points = w->inputs->points;
    for (uint32_t i = 0; i < points->count; i++) {
        lit->first[i] = f3_scale(w->arrived[i], 1 / points->area);
        if (w->through) take_through(w, lit, i);
        const f3 all = f3_add(w->arrived[i], f3_scale(lit->others[i], points->area));
        w->sent[i] = f3_mul(points->points[i].diffuse, all);
        w->arrived[i] = f3_of(0, 0, 0);
    }
}

// Of all points that there are by now, once enough of them are new.
static enum bd_err plant_tree(struct walk *w)
{
    const uint32_t count = w->inputs->points->count;
    if (w->in_tree > 0 && count - w->in_tree <= MAY_BE_NEW(count)) return BD_ERR_OK;
    bd_point_tree_finish(&w->tree);
    bd_slicer_work(w->context.slicer, "point tree");
    w->in_tree = count;
    return bd_point_tree_init(&w->tree, w->inputs->points, bd_slicer_pause, w->context.slicer,
                              w->detail);
}

static enum bd_err walk_on(struct walk *w, struct bd_lit_points *lit)
{
    enum bd_err err = plant_tree(w);
    if (!err) err = shine_all(w);
    if (err) return err;
    reflect_first(w, lit);
    const double at_first = flux_sent(w);
    for (w->round = 1; !err && w->round <= w->inputs->reflections; w->round++) {
        const double flux = flux_sent(w);
        if (!(flux > LEFT_OUT * at_first)) break;
        const double count = PHOTONS_PER_POINT * w->at_first * (flux / at_first);
        err = plant_tree(w);
        if (!err) err = send_on(w, flux, flux / fmax(count, PHOTONS_LEAST));
        reflect(w, lit->further);
    }
    return err;
}

// Of more points, too.
static bool grow(struct walk *w, struct bd_lit_points *lit)
{
    struct bd_surface_points *points = w->inputs->points;
    const size_t most = w->points_max + 1;
    struct bd_surface_point *array = realloc(points->points, most * sizeof *array);
    if (array) points->points = array;
    f3 *others = realloc(lit->others, most * sizeof *others);
    if (others) lit->others = others;
    for (size_t i = points->count; others && i < most; i++) others[i] = f3_of(0, 0, 0);
    lit->first = calloc(most, sizeof *lit->first);
    lit->further = calloc(most, sizeof *lit->further);
    return array && others && lit->first && lit->further;
}

static enum bd_err make_room(struct walk *w, struct bd_lit_points *lit)
{
    w->at_first = w->inputs->points->count;
    w->points_max = 2 * w->at_first;
    const size_t points = w->points_max + 1;
    w->rays = malloc(AT_ONCE * sizeof *w->rays);
    w->photons = malloc(AT_ONCE * sizeof *w->photons);
    w->met = malloc(AT_ONCE * sizeof *w->met);
    w->taken_by = malloc(AT_ONCE * sizeof *w->taken_by);
    w->sought = malloc(AT_ONCE * sizeof *w->sought);
    w->arrived = calloc(points, sizeof *w->arrived);
    w->sent = calloc(points, sizeof *w->sent);
    w->segments = malloc(AT_ONCE * BD_POINT_NEIGHBOURS * sizeof *w->segments);
    w->occluded = malloc(AT_ONCE * BD_POINT_NEIGHBOURS / 8);
    if (w->inputs->glass) {
        w->ways = malloc(AT_ONCE * sizeof *w->ways);
        w->numbers = malloc(AT_ONCE * sizeof *w->numbers);
        w->through = calloc(points, sizeof *w->through);
    }
    const bool has_glass = w->ways && w->numbers && w->through;
    if (w->rays && w->photons && w->met && w->taken_by && w->sought && w->segments && w->occluded &&
        w->arrived && w->sent && (has_glass || !w->inputs->glass) && grow(w, lit))
        return BD_ERR_OK;
    return bd_err_set(w->detail, BD_ERR_NO_MEMORY, "indirect_bounces", "no memory for photons");
}

enum bd_err bd_light_walk_run(const struct bd_pass_context *context,
                              const struct bd_light_walk_inputs *inputs, struct bd_lit_points *lit,
                              struct bd_err_detail *detail)
{
    struct walk w = {.context = *context, .inputs = inputs, .detail = detail};
    bd_surface_hits_init(&w.hits, inputs->snapshot);
    enum bd_err err = make_room(&w, lit);
    if (!err) err = walk_on(&w, lit);
    bd_surface_hits_finish(&w.hits);
    bd_point_tree_finish(&w.tree);
    free(w.rays);
    free(w.photons);
    free(w.met);
    free(w.ways);
    free(w.numbers);
    free(w.through);
    free(w.taken_by);
    free(w.sought);
    free(w.segments);
    free(w.occluded);
    free(w.arrived);
    free(w.sent);
    return err;
}
