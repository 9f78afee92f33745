// Light of emissive triangles, sought from a vertex.
//
// One point is chosen and looked at, in two steps: a few are drawn from the tree of lights, which
// knows boxes and cones alone, then one of them in proportion to what it gives here, were nothing
// in the way (Talbot 2005, resampled importance sampling). What scattering finds of the same light
// is weighed against the tree's pdf. The weight is a part of what is resampled, so that both
// add up to the light, whatever the second step makes of the pdf.

#include <math.h>
#include <stddef.h>

#include "reference/path.h"
#include "reference/vec3f.h"

// So many points are drawn where the eye looks, but no more than one for each two emitters: a
// quad's two triangles need no weighing. Elsewhere one is: light that comes by is as noisy for
// other reasons.
#define POINTS_SEEN 8
// So often each of them is as likely as the others: the strongest may be behind a wall.
#define EVEN_SHARE 0.0625f

// Density per steradian from that per area, for a point as far away along `direction`.
static float per_steradian(float per_area, const struct bd_intersection *at,
                           const float direction[3], float distance)
{
    float cosine = fabsf(bd_vec3f_dot(at->hit.normal_geometric, direction));
    return cosine > 0 ? per_area * distance * distance / cosine : 0;
}

float bd_path_emitter_weight(const struct bd_path *path, const struct bd_vertex *from,
                             const struct bd_intersection *at, const float direction[3])
{
    if (path->is_specular) return 1;
    const struct bd_receiver receiver = bd_path_receiver(from);
    float per_area = bd_emitters_pdf(&path->reference->emitters,
                                     path->integrand->lights_by_flux ? NULL : &receiver, at->part,
                                     at->hit.triangle);
    float other = per_steradian(per_area, at, direction, at->distance);
    return bd_path_power_weight(path->scatter_pdf, other);
}

// A point that may be looked at.
struct aim {
    struct bd_intersection at;
    float direction[3], radiance[3];
    float pdf;      // per steradian
    float value[3]; // scattered towards the eye, by its weight; not set while has_value is false
    bool has_value;
};

// False if it gives nothing, whatever is in the way.
static bool aim_at(const struct bd_path *path, const struct bd_vertex *vertex,
                   const struct bd_light_draw *draw, const float u[2], struct aim *aim)
{
    const struct bd_reference *reference = path->reference;
    struct bd_intersection *at = &aim->at;
    aim->has_value = false;
    bd_emitters_point(&reference->emitters, &reference->geometry, draw->light, u, at);
    bd_vec3f_add_scaled(aim->direction, at->position, vertex->position, -1);
    at->distance = sqrtf(bd_vec3f_dot(aim->direction, aim->direction));
    if (!bd_vec3f_normalize(aim->direction)) return false;
    if (!bd_bsdf_is_reached(&vertex->bsdf.surface, aim->direction)) return false;
    const float back[3] = {-aim->direction[0], -aim->direction[1], -aim->direction[2]};
    bd_emission_at(&reference->geometry, at, back, aim->radiance);
    bd_vec3f_scale(aim->radiance, aim->radiance,
                   bd_geometry_presence(&reference->geometry, at, path->integrand->alpha));
    float per_area = bd_emitters_drawn_pdf(&reference->emitters, draw);
    aim->pdf = per_steradian(per_area, at, aim->direction, at->distance);
    return aim->pdf > 0 && (aim->radiance[0] > 0 || aim->radiance[1] > 0 || aim->radiance[2] > 0);
}

static void evaluate(const struct bd_path *path, const struct bd_vertex *vertex, struct aim *aim)
{
    float scatter_pdf;
    bd_bsdf_eval(&vertex->bsdf, aim->direction, aim->value, &scatter_pdf);
    float survival = bd_path_survival(path, vertex);
    float weight = bd_path_power_weight(aim->pdf, scatter_pdf * survival) / aim->pdf;
    bd_vec3f_filter(aim->value, aim->value, aim->radiance);
    bd_vec3f_scale(aim->value, aim->value, (float)(weight / path->reference->unit_cd_m2));
    aim->has_value = true;
}

static uint32_t count_of(const struct bd_path *path)
{
    if (path->integrand->lights_by_flux || path->events > 0) return 1;
    uint32_t half = (path->reference->emitters.tree.count + 1) / 2;
    return half < POINTS_SEEN ? half : POINTS_SEEN;
}

// The k-th of a sequence that fills the square evenly (Roberts 2018, R2), moved by `u`.
static void spread(const float u[2], uint32_t k, float out[2])
{
    const float step[2] = {0.7548777f, 0.5698403f};
    for (int i = 0; i < 2; i++) {
        float at = u[i] + (float)k * step[i];
        out[i] = bd_minf(at - floorf(at), 1 - 0x1p-24f);
    }
}

// One of several, `value` being what it stands for. A single one is evaluated when it is known to
// be in sight.
static bool choose(struct bd_path *path, const struct bd_vertex *vertex, uint32_t count, double u,
                   const float point[2], struct aim *chosen)
{
    const struct bd_receiver receiver = bd_path_receiver(vertex);
    const struct bd_receiver *for_whom = path->integrand->lights_by_flux ? NULL : &receiver;
    struct bd_light_draw draws[POINTS_SEEN];
    for (uint32_t k = 0; k < count; k++) draws[k].u = (k + u) / count;
    bd_emitters_choose(&path->reference->emitters, for_whom, count, draws);
    if (count == 1) return aim_at(path, vertex, draws, point, chosen);
    float sum = 0, taken = 0;
    uint32_t drawn = 0;
    float left = (float)(bd_sampler_hash(&path->sampler, path->ray_index++) >> 8) * 0x1p-24f;
    bool is_even = bd_path_decide(&left, EVEN_SHARE);
    for (uint32_t k = 0; k < count; k++) {
        float at[2];
        struct aim aim;
        spread(point, k, at);
        if (!aim_at(path, vertex, &draws[k], at, &aim)) continue;
        evaluate(path, vertex, &aim);
        float weight = bd_vec3f_luminance(aim.value);
        if (!(weight > 0)) continue;
        sum += weight;
        drawn++;
        if (!bd_path_decide(&left, is_even ? 1 / (float)drawn : weight / sum)) continue;
        *chosen = aim;
        taken = weight;
    }
    if (!(sum > 0)) return false;
    float probability = (1 - EVEN_SHARE) * taken / sum + EVEN_SHARE / (float)drawn;
    bd_vec3f_scale(chosen->value, chosen->value, 1 / (probability * (float)count));
    return true;
}

static bool sees(struct bd_path *path, const struct bd_vertex *vertex, const struct aim *aim)
{
    const struct bd_intersection *at = &aim->at;
    float target[3], side = bd_vec3f_dot(at->hit.normal_geometric, aim->direction) > 0 ? -1 : 1;
    bd_vec3f_add_scaled(target, at->position, at->hit.normal_geometric, side * at->clearance);
    return bd_path_sees(path, vertex, target);
}

void bd_path_add_emitters(struct bd_path *path, const struct bd_vertex *vertex)
{
    uint32_t bits[2];
    float point[2];
    struct aim aim;
    bd_sampler_pair_bits(&path->sampler, bd_path_pair(path, BD_PAIR_PUNCTUAL_AND_EMITTER), bits);
    bd_sampler_pair(&path->sampler, bd_path_pair(path, BD_PAIR_EMITTER_POINT), point);
    uint32_t count = count_of(path);
    if (!choose(path, vertex, count, bd_path_fine(path, bits[1]), point, &aim)) return;
    if (!sees(path, vertex, &aim)) return;
    if (!aim.has_value) evaluate(path, vertex, &aim);
    bd_path_absorb(vertex, aim.direction, NULL, aim.at.distance, aim.value);
    bd_path_add(path, path->events + 1, aim.value);
}
