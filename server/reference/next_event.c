// Light sought from a vertex: lamps, emissive triangles, the sky.

#include <math.h>
#include <stddef.h>

#include "reference/path.h"
#include "reference/vec3f.h"

// So many lamps are weighed against each other at a vertex, exactly if there are no more.
#define LAMPS_WEIGHED 16
// So often each that gives anything is as likely as the others.
#define EVEN_SHARE 0.0625f

static bool is_lit_by(const struct bd_path *path, enum bd_reference_lights kind)
{
    return path->integrand->lights & (uint32_t)kind;
}

// Power heuristic with exponent 2 (Veach 1997).
static float power_weight(float density, float other)
{
    float a = density * density, b = other * other;
    return a > 0 ? a / (a + b) : 0;
}

// --- lamps --------------------------------------------------------------------------------------

struct candidate {
    const struct bd_lamp *lamp;
    struct bd_illumination light;
    float value[3]; // scattered towards the eye; not set while has_value is false
    bool has_value;
};

static float luminance(const float rgb[3])
{
    return 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2];
}

// False if the lamp gives nothing here, whatever is in the way.
static bool aim(const struct bd_path *path, const struct bd_vertex *vertex,
                const struct bd_lamp *lamp, struct candidate *out)
{
    out->lamp = lamp;
    out->has_value = false;
    return bd_lamp_illuminates(&path->reference->lamps, lamp, vertex->position, &out->light) &&
           bd_bsdf_is_reached(&vertex->bsdf.surface, out->light.direction);
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

// True with probability `share`, by a number that is uniform before and after.
static bool decide(float *u, float share)
{
    bool yes = *u < share;
    *u = yes ? *u / share : (*u - share) / (1 - share);
    return yes;
}

static void offer(struct draw *draw, const struct candidate *candidate, float weight)
{
    draw->sum += weight;
    draw->count++;
    if (decide(&draw->u_taken, weight / draw->sum)) {
        draw->taken = *candidate;
        draw->taken_weight = weight;
    }
    if (decide(&draw->u_even, 1 / (float)draw->count)) {
        draw->even = *candidate;
        draw->even_weight = weight;
    }
}

// One lamp in proportion to what it gives here, were nothing in the way, of all or of so many
// drawn in proportion to flux (Talbot 2005, resampled importance sampling); now and then any of
// them with equal chances, since the strongest may shine on the other side of a wall. `value` is
// then what the chosen one stands for.
static bool weigh_lamps(struct bd_path *path, const struct bd_vertex *vertex, float u,
                        struct candidate *chosen)
{
    const struct bd_lamps *lamps = &path->reference->lamps;
    bool all = lamps->count <= LAMPS_WEIGHED;
    uint32_t count = all ? lamps->count : LAMPS_WEIGHED;
    bool is_even = decide(&u, EVEN_SHARE);
    struct draw draw = {.u_taken = u, .u_even = u};
    for (uint32_t i = 0; i < count; i++) {
        struct candidate candidate;
        const struct bd_lamp *lamp = &lamps->lamps[i];
        float share = 1;
        if (!all) {
            uint32_t hash = bd_sampler_hash(&path->sampler, path->ray_index++);
            lamp =
                bd_lamps_choose(lamps, ((float)i + (float)(hash >> 8) * 0x1p-24f) / (float)count);
            share = 1 / ((float)count * lamp->probability);
        }
        if (!aim(path, vertex, lamp, &candidate)) continue;
        evaluate(vertex, &candidate);
        bd_vec3f_scale(candidate.value, candidate.value, share);
        float weight = luminance(candidate.value);
        if (weight > 0) offer(&draw, &candidate, weight);
    }
    if (!(draw.sum > 0)) return false;
    *chosen = is_even ? draw.even : draw.taken;
    float weight = is_even ? draw.even_weight : draw.taken_weight;
    float probability = (1 - EVEN_SHARE) * weight / draw.sum + EVEN_SHARE / (float)draw.count;
    bd_vec3f_scale(chosen->value, chosen->value, 1 / probability);
    return true;
}

// A single lamp needs no weighing: its value can wait until it is known to be in sight.
static bool choose_lamp(struct bd_path *path, const struct bd_vertex *vertex,
                        struct candidate *chosen)
{
    const struct bd_lamps *lamps = &path->reference->lamps;
    if (lamps->count == 1) return aim(path, vertex, lamps->lamps, chosen);
    float u[2];
    bd_sampler_pair(&path->sampler, bd_path_pair(path, BD_PAIR_LAMP_AND_EMITTER), u);
    return weigh_lamps(path, vertex, u[0], chosen);
}

static bool reaches_lamp(struct bd_path *path, const struct bd_vertex *vertex,
                         const struct candidate *chosen)
{
    const struct bd_reference *reference = path->reference;
    if (chosen->lamp->kind != BD_LIGHT_DIRECTIONAL) {
        bd_dvec3 at = chosen->lamp->position;
        const float target[3] = {(float)at.x, (float)at.y, (float)at.z};
        return bd_path_sees(path, vertex, target, chosen->light.distance);
    }
    float across = 4 * (float)reference->geometry.radius;
    struct bd_ray ray;
    bd_path_ray(path, vertex, chosen->light.direction, 1, across, &ray);
    return !bd_geometry_is_blocked(&reference->geometry, &ray);
}

// What scattering towards the vertex has to itself, when light vertices find it, too.
static float found_weight(const struct bd_path *path, const struct bd_vertex *vertex,
                          const struct bd_illumination *light, float found_density)
{
    if (found_density <= 0 || !bd_path_has_light_vertices(path, path->events + 1)) return 1;
    float cosine = fabsf(bd_vec3f_dot(vertex->bsdf.surface.normal_geometric, light->direction));
    return found_density / (found_density + light->density * cosine);
}

void bd_path_add_lamps(struct bd_path *path, const struct bd_vertex *vertex, float found_density)
{
    if (!is_lit_by(path, BD_REFERENCE_PUNCTUAL) || path->reference->lamps.count == 0) return;
    if (bd_bsdf_is_delta(&vertex->bsdf.surface)) return;
    struct candidate chosen;
    if (!choose_lamp(path, vertex, &chosen) || !reaches_lamp(path, vertex, &chosen)) return;
    if (!chosen.has_value) evaluate(vertex, &chosen);
    float weight = found_weight(path, vertex, &chosen.light, found_density);
    bd_vec3f_scale(chosen.value, chosen.value, weight);
    bd_path_absorb(vertex, chosen.light.direction, NULL, chosen.light.distance, chosen.value);
    bd_path_add(path, path->events + 1, chosen.value);
}

// --- emissive triangles -------------------------------------------------------------------------

// Density per steradian of choosing the point as seen from `distance` away along `direction`.
static float emitter_density(const struct bd_path *path, const struct bd_meeting *at,
                             const float direction[3], float distance)
{
    float per_area = bd_emitters_density(&path->reference->emitters, at->part, at->hit.triangle);
    float cosine = fabsf(bd_vec3f_dot(at->hit.normal_geometric, direction));
    return cosine > 0 ? per_area * distance * distance / cosine : 0;
}

float bd_path_emitter_weight(const struct bd_path *path, const struct bd_meeting *at,
                             const float direction[3])
{
    if (path->is_specular) return 1;
    float other = emitter_density(path, at, direction, at->distance);
    return power_weight(path->scatter_density, other);
}

static void add_emitters(struct bd_path *path, const struct bd_vertex *vertex)
{
    const struct bd_reference *reference = path->reference;
    uint32_t choice[2];
    float u[2], direction[3], value[3], radiance[3], scatter_density;
    struct bd_meeting at;
    bd_sampler_pair_bits(&path->sampler, bd_path_pair(path, BD_PAIR_LAMP_AND_EMITTER), choice);
    bd_sampler_pair(&path->sampler, bd_path_pair(path, BD_PAIR_EMITTER_POINT), u);
    bd_emitters_sample(&reference->emitters, &reference->geometry, choice[1], u, &at);
    bd_vec3f_add_scaled(direction, at.position, vertex->position, -1);
    at.distance = sqrtf(bd_vec3f_dot(direction, direction));
    if (!bd_vec3f_normalize(direction)) return;
    if (!bd_bsdf_is_reached(&vertex->bsdf.surface, direction)) return;
    const float back[3] = {-direction[0], -direction[1], -direction[2]};
    bd_emission_at(&reference->geometry, &at, back, radiance);
    float density = emitter_density(path, &at, direction, at.distance);
    if (!(density > 0) || (radiance[0] == 0 && radiance[1] == 0 && radiance[2] == 0)) return;
    float target[3], side = bd_vec3f_dot(at.hit.normal_geometric, back) < 0 ? -1 : 1;
    bd_vec3f_add_scaled(target, at.position, at.hit.normal_geometric, side * at.clearance);
    if (!bd_path_sees(path, vertex, target, at.distance)) return;
    bd_bsdf_eval(&vertex->bsdf, direction, value, &scatter_density);
    float survival = bd_path_survival(path, vertex);
    float weight = power_weight(density, scatter_density * survival) / density;
    bd_vec3f_filter(value, value, radiance);
    bd_vec3f_scale(value, value, (float)(weight / reference->unit_cd_m2));
    bd_path_absorb(vertex, direction, NULL, at.distance, value);
    bd_path_add(path, path->events + 1, value);
}

// --- the sky ------------------------------------------------------------------------------------

float bd_path_sky_weight(const struct bd_path *path, const float direction[3])
{
    if (path->is_specular) return 1;
    return power_weight(path->scatter_density, bd_sky_density(&path->reference->sky, direction));
}

static void add_sky(struct bd_path *path, const struct bd_vertex *vertex)
{
    const struct bd_reference *reference = path->reference;
    uint32_t bits[2];
    float direction[3], value[3], radiance[3], density, scatter_density;
    bd_sampler_pair_bits(&path->sampler, bd_path_pair(path, BD_PAIR_SKY), bits);
    bd_sky_sample(&reference->sky, bits, direction, &density);
    if (!(density > 0) || !bd_bsdf_is_reached(&vertex->bsdf.surface, direction)) return;
    float across = 4 * (float)reference->geometry.radius;
    struct bd_ray ray;
    bd_path_ray(path, vertex, direction, 1, across, &ray);
    if (bd_geometry_is_blocked(&reference->geometry, &ray)) return;
    bd_sky_radiance(&reference->sky, direction, radiance);
    bd_bsdf_eval(&vertex->bsdf, direction, value, &scatter_density);
    float survival = bd_path_survival(path, vertex);
    float weight = power_weight(density, scatter_density * survival) / density;
    bd_vec3f_filter(value, value, radiance);
    bd_vec3f_scale(value, value, (float)(weight / reference->unit_cd_m2));
    bd_path_absorb(vertex, direction, NULL, INFINITY, value);
    bd_path_add(path, path->events + 1, value);
}

void bd_path_add_areas(struct bd_path *path, const struct bd_vertex *vertex)
{
    if (bd_bsdf_is_delta(&vertex->bsdf.surface)) return;
    if (is_lit_by(path, BD_REFERENCE_EMISSIVE) && path->reference->emitters.count > 0)
        add_emitters(path, vertex);
    if (is_lit_by(path, BD_REFERENCE_ENVIRONMENT) && path->reference->sky.is_sampled)
        add_sky(path, vertex);
}
