#include "pass/area_samples.h"

#include <math.h>
#include <string.h>

#include "lights/directions.h"
#include "lights/triangle_view.h"
#include "pass/lobe.h"

// Of more emitters than are all weighed, so many are drawn from their tree and weighed, for so many
// rays of a half.
#define DRAWN         12u
#define RAYS_OF_DRAWN 8u

// What sequences are for.
enum purpose { OF_CHOICE, OF_DRAW, OF_POINT, OF_MAP, OF_COSINE, OF_LOBE, PURPOSES };

struct sampler {
    const struct bd_area_sampling *sampling;
    const struct bd_area_receiver *at;
    const struct bd_area_shares *shares;
    struct bd_sequence sequence[PURPOSES];
    uint32_t place;
    struct bd_lobe lobe;
    struct bd_segment *segments;
    struct bd_area_light_found *found;
    uint32_t count;
};

struct bd_area_sampling bd_area_sampling_of(const struct bd_area_lights *lights, uint32_t rays,
                                            uint64_t seed)
{
    const uint32_t half = rays / 2;
    return (struct bd_area_sampling){
        .lights = lights,
        .rays = half,
        .lobes = (half + 1) / 2,
        .stride = bd_sequence_stride(half),
        .seed = bd_stirred((uint32_t)seed) ^ bd_stirred((uint32_t)(seed >> 32) + 0x51ed270bu),
    };
}

// --- what is found ------------------------------------------------------------------------------

static struct bd_area_light_found scaled(struct bd_area_light_found f, f3 radiance, float factor)
{
    const f3 light = f3_scale(radiance, factor);
    return (struct bd_area_light_found){f3_mul(f.irradiance, light), f3_mul(f.beyond, light)};
}

// `density`: of all the half's rays that could have gone there, but for those of the lobe.
static void add(struct sampler *s, f3 to, uint32_t to_triangle, f3 direction, f3 radiance,
                float density, float chosen_density)
{
    const struct bd_area_receiver *at = s->at;
    struct bd_segment *segment = &s->segments[s->count];
    struct bd_area_light_found *found = &s->found[s->count];
    const float of_lobe =
        s->shares->lobes ? (float)s->shares->lobes * bd_lobe_pdf(&s->lobe, direction) : 0;
    const float share = density / (density + of_lobe);
    const float factor = s->sampling->from_cd_m2 * share / chosen_density;
    if (!isfinite(factor) || !(factor > 0)) return;
    *segment = (struct bd_segment){.from = {at->position.x, at->position.y, at->position.z},
                                   .from_triangle = at->triangle,
                                   .to = {to.x, to.y, to.z},
                                   .to_triangle = to_triangle};
    *found = scaled(bd_lobe_received(&s->lobe, direction), radiance, factor);
    s->count++;
}

// --- emitters -----------------------------------------------------------------------------------

struct candidate {
    const struct bd_area_light *light;
    struct bd_triangle_view view;
    bool is_aimed;                 // its aim is there
    float weight, stands_for, pdf; // of being drawn, where not all are weighed
};

struct candidates {
    uint32_t count;
    float weight; // together
    struct candidate list[BD_AREA_WEIGHED_MAX];
    struct bd_triangle_aim aims[BD_AREA_WEIGHED_MAX]; // of those that were sent to
};

static void weigh(const struct sampler *s, uint32_t index, float stands_for, float pdf,
                  struct candidates *candidates)
{
    const struct bd_area_lights *lights = s->sampling->lights;
    const struct bd_area_light *light = &lights->lights[index];
    struct candidate *c = &candidates->list[candidates->count];
    if (light->triangle == s->at->triangle) return;
    c->light = light;
    c->view = bd_triangle_view_of(light, lights->sources[light->source].two_sided, s->at->position,
                                  s->at->normal);
    c->is_aimed = false;
    c->weight = stands_for * bd_triangle_view_weight(&c->view, light);
    c->stands_for = stands_for;
    c->pdf = pdf;
    if (!(c->weight > 0) || !isfinite(c->weight)) return;
    candidates->weight += c->weight;
    candidates->count++;
}

// Place of a choice that is made once for rays from `ray` on, in its sequence.
static uint32_t place_of_choice(const struct sampler *s, uint32_t ray)
{
    const uint32_t stride = s->sampling->stride;
    const bool once = stride < RAYS_OF_DRAWN || bd_area_all_are_weighed(s->sampling);
    return (s->place + ray) / (once ? stride : RAYS_OF_DRAWN);
}

// For the rays from `ray` on.
static void find_candidates(struct sampler *s, uint32_t ray, struct candidates *candidates)
{
    const struct bd_area_lights *lights = s->sampling->lights;
    candidates->count = 0;
    candidates->weight = 0;
    if (bd_area_all_are_weighed(s->sampling)) {
        for (uint32_t i = 0; i < lights->count; i++) weigh(s, i, 1, 0, candidates);
        return;
    }
    float number[2];
    struct bd_emitter_cut own;
    const struct bd_emitter_cut *cut = s->at->cut ? s->at->cut : &own;
    if (cut == &own) bd_emitter_tree_cut(&lights->tree, s->at->position, s->at->normal, &own);
    bd_sequence_pair(&s->sequence[OF_DRAW], place_of_choice(s, ray), number);
    for (uint32_t i = 0; i < DRAWN; i++) {
        const float at = ((float)i + number[0]) / DRAWN;
        uint32_t index;
        float pdf;
        if (bd_emitter_tree_draw(&lights->tree, cut, s->at->position, s->at->normal,
                                 f_min(at, 0x1.fffffep-1f), &index, &pdf))
            weigh(s, index, 1 / (DRAWN * pdf), pdf, candidates);
    }
}

static const struct bd_triangle_aim *aim_at(struct candidates *candidates, uint32_t i)
{
    struct candidate *c = &candidates->list[i];
    if (!c->is_aimed) candidates->aims[i] = bd_triangle_aim_of(&c->view);
    c->is_aimed = true;
    return &candidates->aims[i];
}

static void send_to_emitter(struct sampler *s, struct candidates *candidates, uint32_t i,
                            uint32_t ray)
{
    const struct bd_area_receiver *at = s->at;
    const struct candidate *c = &candidates->list[i];
    const struct bd_triangle_aim *aim = aim_at(candidates, i);
    struct bd_triangle_point point;
    float number[2];
    bd_sequence_pair(&s->sequence[OF_POINT], s->place + ray, number);
    if (!bd_triangle_view_choose(&c->view, aim, c->light, at->position, number, &point)) return;
    const f3 direction = f3_unit(f3_sub(point.position, at->position));
    if (!bd_lobe_is_above(&s->lobe, direction)) return;
    const f3 radiance = bd_area_emission_chosen(s->sampling->lights, c->light, point.u, point.v,
                                                f3_scale(direction, -1));
    if (!(radiance.x > 0 || radiance.y > 0 || radiance.z > 0)) return;
    const float rays = (float)s->shares->emitters;
    const float chosen = rays * c->weight / candidates->weight * point.pdf / c->stands_for;
    // How many come here in the mean: of many emitters their chance to be drawn stands for it, and
    // does not depend on what else was drawn.
    const float density = bd_area_all_are_weighed(s->sampling) ? chosen : rays * c->pdf * point.pdf;
    add(s, point.position, c->light->triangle, direction, radiance, density, chosen);
}

// Rays from `first` up to `end`, whose candidates these are.
static void sample_candidates(struct sampler *s, struct candidates *candidates, uint32_t first,
                              uint32_t end)
{
    const float rays = (float)(end - first);
    float number[2], sum = 0;
    uint32_t next = 0;
    bd_sequence_pair(&s->sequence[OF_CHOICE], place_of_choice(s, first), number);
    for (uint32_t i = 0; i < candidates->count; i++) {
        sum += candidates->list[i].weight;
        const bool last = i + 1 == candidates->count;
        while (first + next < end &&
               (last || ((float)next + number[0]) * candidates->weight < sum * rays))
            send_to_emitter(s, candidates, i, first + next++);
    }
}

// Where all emitters are weighed, all rays choose among them; else each few rays among some that
// are drawn for them.
static void sample_emitters(struct sampler *s, struct candidates *candidates)
{
    const uint32_t rays = s->shares->emitters;
    const uint32_t at_once = bd_area_all_are_weighed(s->sampling) ? rays : RAYS_OF_DRAWN;
    for (uint32_t first = 0; first < rays; first += at_once) {
        if (first > 0) find_candidates(s, first, candidates);
        const uint32_t left = rays - first;
        sample_candidates(s, candidates, first, first + (left < at_once ? left : at_once));
    }
}

// --- the sky ------------------------------------------------------------------------------------

// Of the half's rays to the sky, those by the map's density and those by the cosine.
static float sky_density(const struct sampler *s, f3 direction, float of_map)
{
    const float cosine = f_max(f3_dot(s->at->normal, direction), 0);
    const float density = (float)s->shares->cosine * cosine / F_PI;
    return s->shares->map ? density + (float)s->shares->map * of_map : density;
}

// Where the way out leaves the sphere that holds everything.
static f3 end_of_way(const struct bd_area_sampling *sampling, f3 from, f3 direction)
{
    const float along = f3_dot(from, direction);
    const float within = sampling->reach * sampling->reach - f3_dot(from, from) + along * along;
    const float way = f_sqrt(f_max(within, 0)) - along;
    return f3_add(from, f3_scale(direction, f_max(way, 0.01f * sampling->reach)));
}

static void send_to_sky(struct sampler *s, f3 direction)
{
    if (!bd_lobe_is_above(&s->lobe, direction)) return;
    const struct bd_sky_look look = bd_sky_light_look(&s->sampling->lights->sky, direction);
    const float density = sky_density(s, direction, look.pdf);
    if (!(look.radiance.x > 0 || look.radiance.y > 0 || look.radiance.z > 0) || !(density > 0))
        return;
    add(s, end_of_way(s->sampling, s->at->position, direction), BD_NO_TRIANGLE, direction,
        look.radiance, density, density);
}

static void sample_sky(struct sampler *s)
{
    const struct bd_basis basis = bd_basis_of(s->at->normal);
    float number[2];
    for (uint32_t i = 0; i < s->shares->map; i++) {
        bd_sequence_pair(&s->sequence[OF_MAP], s->place + i, number);
        send_to_sky(s, bd_sky_light_choose(&s->sampling->lights->sky, number, NULL));
    }
    for (uint32_t i = 0; i < s->shares->cosine; i++) {
        bd_sequence_pair(&s->sequence[OF_COSINE], s->place + i, number);
        send_to_sky(s, bd_from_basis(&basis, s->at->normal, bd_cosine_direction(number)));
    }
}

// --- the lobe -----------------------------------------------------------------------------------

static void sample_lobe(struct sampler *s, struct bd_area_lobe *lobes)
{
    const struct bd_area_receiver *at = s->at;
    for (uint32_t i = 0; i < s->shares->lobes; i++) {
        float number[2];
        bd_sequence_pair(&s->sequence[OF_LOBE], s->place + i, number);
        const f3 l = bd_lobe_choose(&s->lobe, number);
        const float density = (float)s->shares->lobes * bd_lobe_pdf(&s->lobe, l);
        if (!bd_lobe_is_above(&s->lobe, l) || !(density > 0) || !isfinite(density)) continue;
        const struct bd_area_light_found found = bd_lobe_received(&s->lobe, l);
        lobes[i] = (struct bd_area_lobe){
            .ray = {.origin = {at->position.x, at->position.y, at->position.z},
                    .from_triangle = at->triangle,
                    .direction = {l.x, l.y, l.z},
                    .far = INFINITY},
            .density = density,
            .irradiance = found.irradiance,
            .beyond = found.beyond,
        };
    }
}

// Of rays that light is sought by, whom emitters send none leave theirs to the sky.
static struct bd_area_shares shares_of(const struct bd_area_sampling *sampling, bool emitters,
                                       bool lobe)
{
    const struct bd_sky_light *sky = &sampling->lights->sky;
    struct bd_area_shares shares = {.lobes = lobe ? sampling->lobes : 0};
    uint32_t left = sampling->rays;
    if (emitters) shares.emitters = sky->shines && left > 1 ? (left + 1) / 2 : left;
    left -= shares.emitters;
    if (!sky->shines) return shares;
    shares.map = sky->columns ? (left + 1) / 2 : 0;
    shares.cosine = left - shares.map;
    return shares;
}

static struct sampler sampler_of(const struct bd_area_sampling *sampling,
                                 const struct bd_area_receiver *at,
                                 const struct bd_area_shares *shares)
{
    return (struct sampler){
        .sampling = sampling,
        .at = at,
        .shares = shares,
        .lobe = bd_lobe_of(at, sampling->lambert),
    };
}

// Of one half; of the second, what the first found stands where all emitters are weighed.
static void sample_half(struct sampler *s, uint32_t half, struct candidates *candidates,
                        struct bd_area_lobe *lobes, struct bd_area_shares *shares)
{
    const struct bd_area_sampling *sampling = s->sampling;
    const bool all = bd_area_all_are_weighed(sampling);
    for (uint32_t p = 0; p < PURPOSES; p++)
        s->sequence[p] = bd_sequence_of(sampling->seed, 2 * p + half);
    if (half == 0 || !all) find_candidates(s, 0, candidates);
    // What others' shares are may not depend on what was drawn from a tree.
    const bool emitters = all ? candidates->count > 0 : sampling->lights->count > 0;
    *shares = shares_of(sampling, emitters, s->lobe.is_there);
    shares->weight = candidates->weight;
    s->shares = shares;
    s->count = 0;
    sample_emitters(s, candidates);
    if (sampling->lights->sky.shines) sample_sky(s);
    sample_lobe(s, lobes);
}

void bd_area_sample(const struct bd_area_sampling *sampling, const struct bd_area_receiver *at,
                    uint32_t halves, struct bd_segment *segments, struct bd_area_light_found *found,
                    struct bd_area_lobe *lobes, struct bd_area_shares *shares)
{
    struct sampler s = sampler_of(sampling, at, shares);
    struct candidates candidates;
    s.place = at->place * sampling->stride;
    for (uint32_t half = 0; half < halves; half++) {
        s.segments = segments + (size_t)half * sampling->rays;
        s.found = found + (size_t)half * sampling->rays;
        sample_half(&s, half, &candidates, lobes ? lobes + half * sampling->lobes : NULL,
                    &shares[half]);
    }
}

// --- what lobes met -----------------------------------------------------------------------------

// Of rays to emitters, per steradian around a direction that met one.
static float emitter_density(const struct sampler *s, const struct bd_area_light *light,
                             f3 direction, float distance)
{
    const struct bd_area_lights *lights = s->sampling->lights;
    const struct bd_area_receiver *at = s->at;
    if (light->triangle == at->triangle || s->shares->emitters == 0) return 0;
    const struct bd_triangle_view view = bd_triangle_view_of(
        light, lights->sources[light->source].two_sided, at->position, at->normal);
    const float weight = bd_triangle_view_weight(&view, light);
    if (!(weight > 0) || !isfinite(weight)) return 0;
    float pdf = weight / s->shares->weight;
    if (!bd_area_all_are_weighed(s->sampling)) {
        struct bd_emitter_cut cut;
        bd_emitter_tree_cut(&lights->tree, at->position, at->normal, &cut);
        pdf = bd_emitter_tree_pdf(&lights->tree, &cut, at->position, at->normal,
                                  (uint32_t)(light - lights->lights));
    }
    return (float)s->shares->emitters * pdf *
           bd_triangle_view_pdf(&view, light, direction, distance);
}

struct bd_area_light_found bd_area_lobe_light(const struct bd_area_sampling *sampling,
                                              const struct bd_area_receiver *at,
                                              const struct bd_area_shares *shares,
                                              const struct bd_area_lobe *lobe,
                                              const struct bd_ray_hit *hit)
{
    const struct bd_area_lights *lights = sampling->lights;
    const struct sampler s = sampler_of(sampling, at, shares);
    const f3 l = f3_of(lobe->ray.direction[0], lobe->ray.direction[1], lobe->ray.direction[2]);
    const struct bd_area_light_found nothing = {0}, unit = {lobe->irradiance, lobe->beyond};
    f3 radiance;
    float density;
    if (hit->triangle == BD_NO_TRIANGLE) {
        if (!lights->sky.shines) return nothing;
        const struct bd_sky_look look = bd_sky_light_look(&lights->sky, l);
        radiance = look.radiance;
        density = sky_density(&s, l, look.pdf);
    } else {
        const struct bd_area_light *light = bd_area_light_at(lights, hit->triangle, hit->u, hit->v);
        if (!light) return nothing;
        radiance = bd_area_emission(lights, light, hit->u, hit->v, f3_scale(l, -1));
        density = emitter_density(&s, light, l, hit->distance);
    }
    if (!(radiance.x > 0 || radiance.y > 0 || radiance.z > 0)) return nothing;
    return scaled(unit, radiance, sampling->from_cd_m2 / (density + lobe->density));
}
