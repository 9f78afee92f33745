#include "pass/photon_paths.h"

#include <math.h>
#include <stdlib.h>

#include "kernel/all_channels.h"
#include "kernel/light.h"
#include "lights/reflection.h"
#include "lights/sequence.h"
#include "pass/emitter_photons.h"
#include "pass/landed.h"
#include "pass/nearest.h"
#include "pass/onward.h"
#include "pass/photon_cells.h"
#include "pass/punctual_photons.h"
#include "pass/receivers.h"
#include "pass/sky_photons.h"

// Photons that are on their way at once.
#define AT_ONCE 16384u
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_LANDING 150.0
// Of the scene's radius: how far off photons still tell of a place.
#define REACH 0.25f
// Of so many that land a disk holds about this many: noise and blur shrink alike
// (Silverman 1986: the fourth part of their logarithm less than the third).
#define NEAR_LEAST  128.0
#define NEAR_FACTOR 0.25
// Numbers that nobody else of a frame draws by its seed; with the round, of each purpose 64.
#define OF_PUNCTUALS 0x70756e63u
#define OF_EMITTERS  0x70656d69u
#define OF_SKY       0x70736b79u
#define OF_SKY_PLACE 0x70736b7au
#define OF_GLASS     0x70676c00u
#define OF_WAY       0x70776100u
#define OF_LOBE      0x706c6f00u

struct photon {
    f3 flux;
    // Of the last leg: with what it began, what arrived at its end, and what of that goes on in the
    // mean.
    f3 begun, arrived, reflected;
    float at_first; // its strongest channel, as it set out
    float inverse_range;
    uint32_t number;
    bool is_of_lamp; // and not of the sky
};

struct paths {
    struct bd_pass_context context;
    const struct bd_photon_paths_inputs *inputs;
    struct bd_surface_hits hits;
    uint32_t sent_count;
    // Of those on their way, and what becomes of them in this round.
    uint32_t at_once, round;
    struct bd_ray *rays;
    struct photon *photons;
    struct bd_ray_hit *met;
    struct bd_way *ways; // with glass; else NULL, as are the photons' numbers
    uint32_t *numbers;
    struct bd_photon *landing;
    bool *lands, *goes_on;
    // All that are kept: one of `every` that land, so many times as bright.
    struct bd_photon *landed;
    uint32_t landed_count, landed_room, every, passed_by;
    struct bd_photon_account account;
    struct bd_err_detail *detail;
};

// --- those that are kept ------------------------------------------------------------------------

static enum bd_err grow(struct paths *p)
{
    const uint32_t room = p->landed_room ? 2 * p->landed_room : 4 * AT_ONCE;
    struct bd_photon *grown = realloc(p->landed, room * sizeof *grown);
    if (!grown)
        return bd_err_set(p->detail, BD_ERR_NO_MEMORY, "photons", "no memory for %u photons", room);
    p->landed = grown;
    p->landed_room = room;
    return BD_ERR_OK;
}

// Every other one, twice as bright.
static void thin_out(struct paths *p)
{
    p->landed_count /= 2;
    p->every *= 2;
    for (uint32_t i = 0; i < p->landed_count; i++) {
        p->landed[i] = p->landed[2 * i];
        p->landed[i].flux = f3_scale(p->landed[i].flux, 2);
    }
}

static enum bd_err keep(struct paths *p, const struct bd_photon *photon)
{
    if (++p->passed_by < p->every) return BD_ERR_OK;
    p->passed_by = 0;
    if (p->landed_count == BD_PHOTONS_LANDED_MAX) thin_out(p);
    enum bd_err err = p->landed_count == p->landed_room ? grow(p) : BD_ERR_OK;
    if (err) return err;
    p->landed[p->landed_count] = *photon;
    p->landed[p->landed_count++].flux = f3_scale(photon->flux, (float)p->every);
    return BD_ERR_OK;
}

// --- a leg of their way -------------------------------------------------------------------------

static void draw(const struct paths *p, uint32_t number, float way_and_lobe[3], float *roulette)
{
    const uint32_t seed = (uint32_t)(p->inputs->seed ^ p->inputs->seed >> 32);
    const struct bd_sequence of_way = bd_sequence_of(seed, OF_WAY + p->round);
    const struct bd_sequence of_lobe = bd_sequence_of(seed, OF_LOBE + p->round);
    float lobe[2];
    bd_sequence_pair(&of_way, number, way_and_lobe);
    bd_sequence_pair(&of_lobe, number, lobe);
    way_and_lobe[2] = lobe[0];
    *roulette = lobe[1];
}

// Whether nobody else tells it.
static bool is_kept(const struct paths *p, uint32_t i)
{
    if (p->round > 0) return true;
    if (!p->ways || p->ways[i].straight) return false;
    return !(p->photons[i].is_of_lamp && p->inputs->caustics_apart);
}

static void reflect(const struct paths *p, uint32_t i, const struct bd_surface_point *at)
{
    const struct bd_ray_hit *hit = &p->met[i];
    struct photon *photon = &p->photons[i];
    const float *d = p->rays[i].direction;
    struct bd_reflection onward;
    float number[3], roulette;
    draw(p, photon->number, number, &roulette);
    if (!bd_reflect(&p->hits, at, hit->u, hit->v, f3_of(d[0], d[1], d[2]), p->inputs->lambert,
                    p->ways && p->ways[i].rest < 1, number, &onward))
        return;
    const f3 flux = photon->reflected = f3_mul(photon->flux, onward.weight);
    const float left = f_min(strongest_channel(flux) / photon->at_first, 1);
    if (!(roulette < left)) return;
    photon->flux = f3_scale(flux, 1 / left);
    p->goes_on[i] = true;
    p->rays[i] =
        (struct bd_ray){.origin = {at->position.x, at->position.y, at->position.z},
                        .from_triangle = at->triangle,
                        .direction = {onward.direction.x, onward.direction.y, onward.direction.z},
                        .far = INFINITY};
}

// On a surface that is glass or a mirror in part as much falls for each photon that ends there as
// if none went on.
static f3 fallen(const struct paths *p, uint32_t i)
{
    return p->ways ? f3_scale(p->photons[i].flux, 1 / p->ways[i].rest) : p->photons[i].flux;
}

static void land(const struct paths *p, uint32_t i)
{
    const struct bd_ray_hit *hit = &p->met[i];
    struct photon *photon = &p->photons[i];
    const float *d = p->rays[i].direction;
    struct bd_surface_point at;
    p->lands[i] = p->goes_on[i] = false;
    if (p->ways) photon->flux = f3_mul(photon->flux, p->ways[i].weight);
    photon->arrived = photon->flux;
    photon->reflected = f3_of(0, 0, 0);
    if (hit->triangle == BD_NO_TRIANGLE) return;
    if (!(strongest_channel(photon->flux) > 0) ||
        !bd_surface_hit_at(&p->hits, hit->triangle, hit->u, hit->v, f3_of(d[0], d[1], d[2]), &at))
        return;
    p->lands[i] = is_kept(p, i);
    p->landing[i] = (struct bd_photon){.position = at.position,
                                       .normal = at.normal,
                                       .flux = fallen(p, i),
                                       .way = f3_of(-d[0], -d[1], -d[2])};
    if (p->round < p->inputs->reflections) reflect(p, i, &at);
}

static void land_group(void *user, uint32_t group)
{
    const struct paths *p = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES && i < p->at_once; i++)
        land(p, i);
}

// A lamp's range is that of its first leg.
static void leave_lamp(struct paths *p, uint32_t i)
{
    struct photon *photon = &p->photons[i];
    photon->flux =
        f3_scale(photon->flux, window_of_range(p->met[i].distance, photon->inverse_range));
}

static enum bd_err go_through(struct paths *p, struct bd_ray_counts *traced)
{
    const struct bd_photon_paths_inputs *in = p->inputs;
    for (uint32_t i = 0; i < p->at_once; i++) {
        p->ways[i] = bd_way_begins;
        p->numbers[i] = p->photons[i].number;
    }
    return bd_onward_run(&p->context, &p->hits, in->visibility, BD_CARRIES_FLUX,
                         in->seed ^ (OF_GLASS + p->round), p->numbers, p->rays, p->met, p->ways,
                         p->at_once, NULL, traced, p->detail);
}

static double sum_of(f3 flux)
{
    return (double)flux.x + flux.y + flux.z;
}

// Of a photon whose leg has ended. One that is lost within glass has met nothing with no weight.
static void account_for(struct paths *p, uint32_t i)
{
    const struct photon *photon = &p->photons[i];
    struct bd_photon_account *to = &p->account;
    const double begun = sum_of(photon->begun), arrived = sum_of(photon->arrived);
    const double reflected = sum_of(photon->reflected);
    const bool met_nothing = p->met[i].triangle == BD_NO_TRIANGLE;
    if (met_nothing && begun > 0 && arrived == 0) {
        to->lost += begun;
        return;
    }
    to->absorbed += begun - arrived;
    if (met_nothing) {
        to->left += arrived;
        return;
    }
    const bool is_last = p->round >= p->inputs->reflections;
    to->absorbed += is_last ? 0 : arrived - reflected;
    to->dropped += is_last ? arrived : reflected - (p->goes_on[i] ? sum_of(photon->flux) : 0);
}

// In the order of the photons, whichever thread found where they go.
static enum bd_err close_ranks(struct paths *p)
{
    enum bd_err err = BD_ERR_OK;
    uint32_t left = 0;
    for (uint32_t i = 0; !err && i < p->at_once; i++) {
        if (p->lands[i]) err = keep(p, &p->landing[i]);
        account_for(p, i);
        if (!p->goes_on[i]) continue;
        p->rays[left] = p->rays[i];
        p->photons[left++] = p->photons[i];
    }
    p->at_once = left;
    return err;
}

static enum bd_err go_on(struct paths *p)
{
    struct bd_ray_counts traced = {0};
    bd_slicer_work(p->context.slicer, "photons");
    enum bd_err err = bd_nearest_ask(&p->context, p->inputs->visibility, p->rays, p->at_once,
                                     p->met, &traced, p->detail);
    for (uint32_t i = 0; !err && i < p->at_once; i++) p->photons[i].begun = p->photons[i].flux;
    for (uint32_t i = 0; !err && p->round == 0 && i < p->at_once; i++) leave_lamp(p, i);
    if (!err && p->ways) err = go_through(p, &traced);
    bd_slicer_work(p->context.slicer, "photons");
    if (!err)
        err = bd_receivers_each(&p->context, (p->at_once + BD_LANES - 1) / BD_LANES,
                                UNITS_PER_LANDING * BD_LANES, land_group, p);
    return err ? err : close_ranks(p);
}

// Until none is left.
static enum bd_err let_fly(struct paths *p)
{
    enum bd_err err = BD_ERR_OK;
    for (p->round = 0; !err && p->at_once > 0 && p->round <= p->inputs->reflections; p->round++)
        err = go_on(p);
    p->at_once = 0;
    return err;
}

// --- from the lamps -----------------------------------------------------------------------------

static enum bd_err set_out(struct paths *p, struct bd_ray ray, f3 flux, float inverse_range,
                           bool is_of_lamp)
{
    const float at_first = strongest_channel(flux);
    const uint32_t number = p->sent_count++;
    if (!(at_first > 0)) return BD_ERR_OK;
    p->account.sent += sum_of(flux);
    p->rays[p->at_once] = ray;
    p->photons[p->at_once] = (struct photon){.flux = flux,
                                             .at_first = at_first,
                                             .inverse_range = inverse_range,
                                             .number = number,
                                             .is_of_lamp = is_of_lamp};
    return ++p->at_once == AT_ONCE ? let_fly(p) : BD_ERR_OK;
}

static uint32_t seed_of(const struct paths *p)
{
    return (uint32_t)(p->inputs->seed ^ p->inputs->seed >> 32);
}

// At least one of whoever sends anything.
static uint32_t share_of(const struct paths *p, double flux, double of_all)
{
    return flux > 0 ? (uint32_t)fmax(round(flux / of_all * p->inputs->count), 1) : 0;
}

static double flux_of(const struct bd_light_uniform *punctual)
{
    return strongest_channel(bd_punctual_flux(punctual));
}

static enum bd_err shine(struct paths *p, const struct bd_light_uniform *punctual, double of_all)
{
    const struct bd_sequence sequence = bd_sequence_of(seed_of(p), OF_PUNCTUALS);
    const f3 flux = bd_punctual_flux(punctual);
    const uint32_t count = share_of(p, flux_of(punctual), of_all);
    const uint32_t first = p->sent_count; // or lamps of one photon all send it the same way
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < count; i++) {
        float number[2];
        bd_sequence_pair(&sequence, first + i, number);
        err = set_out(p, bd_punctual_ray(punctual, number), f3_scale(flux, 1 / (float)count),
                      punctual->inverse_range, true);
    }
    return err;
}

static enum bd_err shine_of_emitters(struct paths *p, uint32_t count)
{
    struct bd_emitter_photons photons = bd_emitter_photons_of(
        p->inputs->lights, count, p->inputs->from_cd_m2, seed_of(p), OF_EMITTERS);
    struct bd_ray ray;
    f3 flux, normal;
    enum bd_err err = BD_ERR_OK;
    while (!err && bd_emitter_photons_next(&photons, &ray, &flux, &normal))
        err = set_out(p, ray, flux, 0, true);
    return err;
}

static enum bd_err shine_of_sky(struct paths *p, const struct bd_sky_photons *sky, uint32_t count)
{
    const struct bd_sequence of_way = bd_sequence_of(seed_of(p), OF_SKY);
    const struct bd_sequence of_place = bd_sequence_of(seed_of(p), OF_SKY_PLACE);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < count; i++) {
        float way[2], place[2];
        f3 flux;
        bd_sequence_pair(&of_way, i, way);
        bd_sequence_pair(&of_place, i, place);
        const struct bd_ray ray = bd_sky_photons_ray(sky, way, place, &flux);
        err = set_out(p, ray, f3_scale(flux, 1 / (float)count), 0, false);
    }
    return err;
}

static enum bd_err shine_all(struct paths *p)
{
    const struct bd_photon_paths_inputs *in = p->inputs;
    const struct bd_sky_photons sky = {in->lights ? &in->lights->sky : NULL,
                                       (float)p->hits.space.radius, in->from_cd_m2};
    const double of_sky = in->lights && in->lights->sky.shines ? bd_sky_photons_flux(&sky) : 0;
    const double of_emitters = bd_emitters_flux(in->lights, in->from_cd_m2);
    double all = of_sky + of_emitters;
    for (uint32_t i = 0; i < in->punctual_count; i++) all += flux_of(&in->punctuals[i]);
    enum bd_err err = BD_ERR_OK;
    if (!(all > 0) || !isfinite(all)) return err;
    for (uint32_t i = 0; !err && i < in->punctual_count; i++)
        err = shine(p, &in->punctuals[i], all);
    if (!err && of_emitters > 0) err = shine_of_emitters(p, share_of(p, of_emitters, all));
    if (!err && of_sky > 0) err = shine_of_sky(p, &sky, share_of(p, of_sky, all));
    return err ? err : let_fly(p);
}

// --- the map ------------------------------------------------------------------------------------

static uint32_t near_of(uint32_t count)
{
    return (uint32_t)fmax(NEAR_FACTOR * pow(count, 2.0 / 3), NEAR_LEAST);
}

static enum bd_err make_map(struct paths *p, struct bd_photon_map **out)
{
    const struct bd_photon_map_how how = {.reach = REACH * (float)p->hits.space.radius,
                                          .near = near_of(p->landed_count),
                                          .radius = p->inputs->radius};
    return bd_landed_map(&p->context, p->inputs->snapshot,
                         p->inputs->visibility->alpha == BD_RAYS_ALPHA_COVERAGE, p->landed,
                         p->landed_count, &how, out, p->detail);
}

static enum bd_err make_cells(struct paths *p, const struct bd_photon_map *map,
                              struct bd_irradiance_cells **out)
{
    const struct bd_photon_cells_inputs cells = {.photons = p->landed,
                                                 .count = p->landed_count,
                                                 .map = map,
                                                 .visibility = p->inputs->visibility,
                                                 .surfaces = &p->hits};
    return bd_photon_cells_run(&p->context, &cells, out, p->detail);
}

static enum bd_err make_room(struct paths *p)
{
    p->rays = malloc(AT_ONCE * sizeof *p->rays);
    p->photons = malloc(AT_ONCE * sizeof *p->photons);
    p->met = malloc(AT_ONCE * sizeof *p->met);
    p->landing = malloc(AT_ONCE * sizeof *p->landing);
    p->lands = malloc(AT_ONCE * sizeof *p->lands);
    p->goes_on = malloc(AT_ONCE * sizeof *p->goes_on);
    if (p->inputs->glass) {
        p->ways = malloc(AT_ONCE * sizeof *p->ways);
        p->numbers = malloc(AT_ONCE * sizeof *p->numbers);
    }
    const bool has_glass = p->ways && p->numbers;
    if (p->rays && p->photons && p->met && p->landing && p->lands && p->goes_on &&
        (has_glass || !p->inputs->glass))
        return BD_ERR_OK;
    return bd_err_set(p->detail, BD_ERR_NO_MEMORY, "photons", "no memory for %u photons",
                      p->inputs->count);
}

enum bd_err bd_photon_paths_run(const struct bd_pass_context *context,
                                const struct bd_photon_paths_inputs *inputs,
                                struct bd_photon_map **out, struct bd_irradiance_cells **cells,
                                struct bd_photon_account *account, struct bd_err_detail *detail)
{
    struct paths p = {.context = *context, .inputs = inputs, .every = 1, .detail = detail};
    *out = NULL;
    *cells = NULL;
    bd_surface_hits_init(&p.hits, inputs->snapshot);
    enum bd_err err = make_room(&p);
    if (!err) err = shine_all(&p);
    if (!err) err = make_map(&p, out);
    if (!err && !inputs->lambert) err = make_cells(&p, *out, cells);
    bd_surface_hits_finish(&p.hits);
    *account = p.account;
    void *arrays[] = {p.rays,    p.photons, p.met,     p.landing, p.lands,
                      p.goes_on, p.ways,    p.numbers, p.landed};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    return err;
}
