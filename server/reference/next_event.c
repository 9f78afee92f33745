// Light sought from a vertex: punctual lights, the sky. Emissive triangles: next_emitter.c.

#include <math.h>
#include <stddef.h>

#include "reference/path.h"
#include "reference/vec3f.h"

// So many punctual lights are weighed against each other at a vertex, exactly if there are no more.
#define PUNCTUALS_WEIGHED 16
// Else so many are drawn of those that have a place, where the eye looks and where light only comes
// by; and so many of those infinitely far away.
#define PUNCTUALS_SEEN    8
#define PUNCTUALS_PASSING 4
#define PUNCTUALS_AFAR    4
// So often each that gives anything is as likely as the others.
#define EVEN_SHARE 0.0625f

static bool is_lit_by(const struct bd_path *path, enum bd_reference_lights kind)
{
    return bd_path_lights(path, path->events + 1) & (uint32_t)kind;
}

// --- punctual lights -----------------------------------------------------------------------------

struct candidate {
    const struct bd_punctual *punctual;
    struct bd_illumination light;
    float value[3]; // scattered towards the eye; not set while has_value is false
    bool has_value;
    float probability; // of what was drawn
};

// False if the punctual light gives nothing here, whatever is in the way.
static bool aim(const struct bd_path *path, const struct bd_vertex *vertex,
                const struct bd_punctual *punctual, struct candidate *out)
{
    out->punctual = punctual;
    out->has_value = false;
    out->probability = 1;
    return bd_punctual_illuminates(&path->reference->punctuals, punctual, vertex->position,
                                   &out->light) &&
           (path->lamp_radius > 0 ||
            bd_bsdf_is_reached(&vertex->bsdf.surface, out->light.direction));
}

static void evaluate(const struct bd_vertex *vertex, struct candidate *candidate)
{
    bd_bsdf_eval(&vertex->bsdf, candidate->light.direction, candidate->value, NULL);
    bd_vec3f_filter(candidate->value, candidate->value, candidate->light.normal_illuminance);
    candidate->has_value = true;
}

// Draws candidates one after the other: `taken` in proportion to weight, `even` each as likely.
struct draw {
    struct candidate taken, even;
    float taken_weight, even_weight;
    float sum;
    uint32_t count;
    float u_taken, u_even; // what is left of each stays uniform
};

static void offer(struct draw *draw, const struct candidate *candidate, float weight)
{
    draw->sum += weight;
    draw->count++;
    if (bd_path_decide(&draw->u_taken, weight / draw->sum)) {
        draw->taken = *candidate;
        draw->taken_weight = weight;
    }
    if (bd_path_decide(&draw->u_even, 1 / (float)draw->count)) {
        draw->even = *candidate;
        draw->even_weight = weight;
    }
}

static void weigh(struct bd_path *path, const struct bd_vertex *vertex,
                  const struct bd_punctual *punctual, float probability, struct draw *draw)
{
    struct candidate candidate;
    if (!aim(path, vertex, punctual, &candidate)) return;
    // Of a light with a radius by what it gives across: every part of it may be drawn.
    if (path->lamp_radius > 0)
        bd_vec3f_copy(candidate.value, candidate.light.normal_illuminance);
    else
        evaluate(vertex, &candidate);
    candidate.probability = probability;
    bd_vec3f_scale(candidate.value, candidate.value, 1 / probability);
    float weight = bd_vec3f_luminance(candidate.value);
    if (weight > 0) offer(draw, &candidate, weight);
}

static void weigh_all(struct bd_path *path, const struct bd_vertex *vertex, uint32_t first,
                      struct draw *draw)
{
    const struct bd_punctuals *punctuals = &path->reference->punctuals;
    for (uint32_t i = first; i < punctuals->count; i++)
        weigh(path, vertex, &punctuals->punctuals[i], 1, draw);
}

static void weigh_by_flux(struct bd_path *path, const struct bd_vertex *vertex, struct draw *draw)
{
    const struct bd_punctuals *punctuals = &path->reference->punctuals;
    for (uint32_t i = 0; i < PUNCTUALS_WEIGHED; i++) {
        uint32_t hash = bd_sampler_hash(&path->sampler, path->ray_index++);
        const struct bd_punctual *punctual = bd_punctuals_choose(
            punctuals, ((float)i + (float)(hash >> 8) * 0x1p-24f) / PUNCTUALS_WEIGHED);
        weigh(path, vertex, punctual, PUNCTUALS_WEIGHED * punctual->probability, draw);
    }
}

// Punctual lights at a place by the tree; directional ones have a share of their own, in which each
// is as likely as the others, if they are many.
static void weigh_by_place(struct bd_path *path, const struct bd_vertex *vertex, struct draw *draw)
{
    const struct bd_punctuals *punctuals = &path->reference->punctuals;
    const struct bd_receiver receiver = bd_path_receiver(vertex);
    const uint32_t far_count = punctuals->count - punctuals->near_count;
    uint32_t bits = bd_sampler_hash(&path->sampler, path->ray_index++);
    double u = bd_path_fine(path, bits);
    const uint32_t count = path->events == 0 ? PUNCTUALS_SEEN : PUNCTUALS_PASSING;
    struct bd_light_draw draws[PUNCTUALS_SEEN];
    for (uint32_t i = 0; i < count; i++) draws[i].u = (i + u) / count;
    if (punctuals->near_count > 0) bd_light_tree_choose(&punctuals->tree, &receiver, count, draws);
    for (uint32_t i = 0; i < count && punctuals->near_count > 0; i++)
        weigh(path, vertex, &punctuals->punctuals[draws[i].light],
              (float)count * draws[i].probability, draw);
    if (far_count <= PUNCTUALS_AFAR) {
        weigh_all(path, vertex, punctuals->near_count, draw);
        return;
    }
    for (uint32_t i = 0; i < PUNCTUALS_AFAR; i++) {
        uint32_t at = (uint32_t)((i + u) / PUNCTUALS_AFAR * far_count);
        weigh(path, vertex, &punctuals->punctuals[punctuals->near_count + at],
              (float)PUNCTUALS_AFAR / (float)far_count, draw);
    }
}

// One punctual light in proportion to what it gives here, were nothing in the way, of all or of so
// many drawn before (Talbot 2005, resampled importance sampling); now and then any of them with
// equal chances, since the strongest may shine on the other side of a wall. `value` is then what
// the chosen one stands for.
static bool weigh_punctuals(struct bd_path *path, const struct bd_vertex *vertex, float u,
                            struct candidate *chosen)
{
    bool is_even = bd_path_decide(&u, EVEN_SHARE);
    struct draw draw = {.u_taken = u, .u_even = u};
    if (path->reference->punctuals.count <= PUNCTUALS_WEIGHED)
        weigh_all(path, vertex, 0, &draw);
    else if (path->integrand->lights_by_flux || path->lamp_radius > 0)
        weigh_by_flux(path, vertex, &draw);
    else
        weigh_by_place(path, vertex, &draw);
    if (!(draw.sum > 0)) return false;
    *chosen = is_even ? draw.even : draw.taken;
    float weight = is_even ? draw.even_weight : draw.taken_weight;
    float probability = (1 - EVEN_SHARE) * weight / draw.sum + EVEN_SHARE / (float)draw.count;
    bd_vec3f_scale(chosen->value, chosen->value, 1 / probability);
    chosen->probability *= probability;
    return true;
}

// A single punctual light needs no weighing: its value can wait until it is known to be in sight.
static bool choose_punctual(struct bd_path *path, const struct bd_vertex *vertex,
                            struct candidate *chosen)
{
    const struct bd_punctuals *punctuals = &path->reference->punctuals;
    if (punctuals->count == 1) return aim(path, vertex, punctuals->punctuals, chosen);
    float u[2];
    bd_sampler_pair(&path->sampler, bd_path_pair(path, BD_PAIR_PUNCTUAL_AND_EMITTER), u);
    return weigh_punctuals(path, vertex, u[0], chosen);
}

// Instead of its middle a direction towards a light with a radius, which scattering finds, too.
static void spread(struct bd_path *path, const struct bd_vertex *vertex, struct candidate *chosen)
{
    if (!(path->lamp_radius > 0)) return;
    const float pdf = bd_path_spread_lamp(path, &chosen->light);
    float scatter_pdf;
    bd_bsdf_eval(&vertex->bsdf, chosen->light.direction, chosen->value, &scatter_pdf);
    bd_vec3f_filter(chosen->value, chosen->value, chosen->light.normal_illuminance);
    const float found = scatter_pdf * bd_path_survival(path, vertex);
    const bool is_found = pdf > 0 && path->integrand->indirect_visibility;
    const float weight = is_found ? bd_path_power_weight(pdf, found) : 1;
    bd_vec3f_scale(chosen->value, chosen->value, weight / chosen->probability);
    chosen->has_value = true;
}

static bool reaches_punctual(struct bd_path *path, const struct bd_vertex *vertex,
                             const struct candidate *chosen, struct bd_straight_way *way)
{
    struct bd_ray ray;
    if (chosen->punctual->kind != BD_LIGHT_DIRECTIONAL) {
        bd_dvec3 at = chosen->punctual->position;
        float target[3] = {(float)at.x, (float)at.y, (float)at.z};
        if (path->lamp_radius > 0)
            bd_vec3f_add_scaled(target, vertex->position, chosen->light.direction,
                                chosen->light.distance);
        bd_path_ray_to(path, vertex, target, &ray);
    } else {
        const float across = 4 * (float)path->reference->geometry.radius;
        bd_path_ray(path, vertex, chosen->light.direction, across, &ray);
    }
    return bd_path_passes(path, &ray, way);
}

// What scattering towards the vertex has to itself, when light vertices find it, too.
static float found_weight(const struct bd_path *path, const struct bd_vertex *vertex,
                          const struct bd_illumination *light, float found_pdf)
{
    if (found_pdf <= 0 || !bd_path_has_light_vertices(path, path->events + 1)) return 1;
    float cosine = fabsf(bd_vec3f_dot(vertex->bsdf.surface.normal_geometric, light->direction));
    return found_pdf / (found_pdf + light->pdf * cosine);
}

void bd_path_add_punctuals(struct bd_path *path, const struct bd_vertex *vertex, float found_pdf)
{
    if (!is_lit_by(path, BD_REFERENCE_PUNCTUAL) || path->reference->punctuals.count == 0) return;
    if (bd_bsdf_is_delta(&vertex->bsdf.surface)) return;
    struct candidate chosen;
    struct bd_straight_way way;
    if (!choose_punctual(path, vertex, &chosen)) return;
    spread(path, vertex, &chosen);
    if (!reaches_punctual(path, vertex, &chosen, &way)) return;
    if (!chosen.has_value) evaluate(vertex, &chosen);
    chosen.light.pdf *= way.chance;
    float weight = found_weight(path, vertex, &chosen.light, found_pdf);
    bd_vec3f_scale(chosen.value, chosen.value, weight);
    bd_vec3f_filter(chosen.value, chosen.value, way.passed);
    bd_path_absorb(vertex, chosen.light.direction, NULL, chosen.light.distance, chosen.value);
    bd_path_add(path, path->events + 1, chosen.value);
}

// --- the sky ------------------------------------------------------------------------------------

float bd_path_sky_weight(const struct bd_path *path, const float direction[3])
{
    if (path->is_specular) return 1;
    return bd_path_power_weight(path->scatter_pdf, bd_sky_pdf(&path->reference->sky, direction));
}

static void add_sky(struct bd_path *path, const struct bd_vertex *vertex)
{
    const struct bd_reference *reference = path->reference;
    uint32_t bits[2];
    float direction[3], value[3], radiance[3], pdf, scatter_pdf;
    bd_sampler_pair_bits(&path->sampler, bd_path_pair(path, BD_PAIR_SKY), bits);
    bd_sky_sample(&reference->sky, bits, direction, &pdf);
    if (!(pdf > 0) || !bd_bsdf_is_reached(&vertex->bsdf.surface, direction)) return;
    float across = 4 * (float)reference->geometry.radius;
    struct bd_ray ray;
    bd_path_ray(path, vertex, direction, across, &ray);
    if (bd_geometry_is_blocked(&reference->geometry, &ray)) return;
    bd_sky_radiance(&reference->sky, direction, radiance);
    bd_bsdf_eval(&vertex->bsdf, direction, value, &scatter_pdf);
    float survival = bd_path_survival(path, vertex);
    float weight = bd_path_power_weight(pdf, scatter_pdf * survival) / pdf;
    bd_vec3f_filter(value, value, radiance);
    bd_vec3f_scale(value, value, (float)(weight / reference->unit_cd_m2));
    bd_path_absorb(vertex, direction, NULL, INFINITY, value);
    bd_path_add(path, path->events + 1, value);
}

void bd_path_add_areas(struct bd_path *path, const struct bd_vertex *vertex)
{
    if (bd_bsdf_is_delta(&vertex->bsdf.surface)) return;
    if (is_lit_by(path, BD_REFERENCE_EMISSIVE) && path->reference->emitters.count > 0)
        bd_path_add_emitters(path, vertex);
    if (is_lit_by(path, BD_REFERENCE_ENVIRONMENT) && path->reference->sky.is_sampled)
        add_sky(path, vertex);
}
