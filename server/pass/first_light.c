#include "pass/first_light.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "kernel/all_channels.h"
#include "kernel/brdf.h"
#include "lights/reflection.h"
#include "lights/sequence.h"
#include "pass/area_samples.h"
#include "pass/f3_arrays.h"
#include "pass/punctual_photons.h"
#include "pass/receivers.h"
#include "pass/straight.h"

// To emitters and the sky.
#define AREA_RAYS 2u
// Places whose rays are on their way at once.
#define AT_ONCE 16384u
// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_PLACE    300.0
#define UNITS_PER_PUNCTUAL 4.0
#define UNITS_PER_SUM      40.0
// Numbers that nobody else of a frame draws by its seed.
#define OF_PUNCTUALS 0x6c616d70u

struct lighting {
    const struct bd_pass_context *context;
    const struct bd_first_light *light;
    struct bd_area_sampling sampling;
    struct bd_sequence sequence;
    const struct bd_first_looks *looks;
    // Of a part.
    uint32_t first, count;
    const struct bd_surface_point *places;
    f3 *irradiance;
    float *cosine;
    // Of each place its rays, and what they bring.
    uint32_t ray_count;
    struct bd_segment *segments;
    f3 *brought;
    uint32_t *occluded;
};

static uint32_t punctuals_asked(const struct bd_first_light *light)
{
    return light->punctual_count < BD_FIRST_PUNCTUALS ? light->punctual_count : BD_FIRST_PUNCTUALS;
}

// --- punctual lights -----------------------------------------------------------------------------

static bool is_brought_by_others(const struct bd_first_light *light, uint32_t i,
                                 const struct bd_surface_point *place)
{
    if (!light->near2) return false;
    const f3 way = f3_sub(f3_from(&light->punctuals[i].position), place->position);
    return f3_dot(way, way) < light->near2[i];
}

static f3 light_of_punctual(const struct bd_first_light *light, uint32_t i,
                            const struct bd_surface_point *place)
{
    if (is_brought_by_others(light, i, place)) return f3_of(0, 0, 0);
    return bd_punctual_irradiance(&light->punctuals[i], place->position, place->normal);
}

static void ask_punctual(const struct lighting *l, const struct bd_surface_point *place,
                         const struct bd_light_uniform *punctual, f3 brings, uint32_t ray)
{
    const f3 direction = f3_of(punctual->direction.x, punctual->direction.y, punctual->direction.z);
    const f3 from = place->position;
    const f3 to = punctual->kind == BD_LIGHT_KIND_DIRECTIONAL
                      ? f3_sub(from, f3_scale(direction, punctual->distance))
                      : f3_of(punctual->position.x, punctual->position.y, punctual->position.z);
    l->brought[ray] = brings;
    if (!(brings.x > 0 || brings.y > 0 || brings.z > 0)) return;
    l->segments[ray] = (struct bd_segment){.from = {from.x, from.y, from.z},
                                           .from_triangle = place->triangle,
                                           .to = {to.x, to.y, to.z},
                                           .to_triangle = BD_NO_TRIANGLE};
}

// In even steps through what all would give.
static void draw_punctuals(const struct lighting *l, const struct bd_surface_point *place,
                           uint32_t ray)
{
    const struct bd_first_light *light = l->light;
    float sum = 0, passed = 0, start[2];
    for (uint32_t i = 0; i < light->punctual_count; i++)
        sum += strongest_channel(light_of_punctual(light, i, place));
    if (!(sum > 0)) return;
    bd_sequence_pair(&l->sequence, place->number, start);
    const float step = sum / BD_FIRST_PUNCTUALS;
    uint32_t next = 0;
    for (uint32_t i = 0; i < light->punctual_count && next < BD_FIRST_PUNCTUALS; i++) {
        const f3 brings = light_of_punctual(light, i, place);
        passed += strongest_channel(brings);
        for (; next < BD_FIRST_PUNCTUALS && ((float)next + start[0]) * step < passed; next++)
            ask_punctual(l, place, &light->punctuals[i],
                         f3_scale(brings, step / strongest_channel(brings)), ray + next);
    }
}

static void ask_punctuals(const struct lighting *l, const struct bd_surface_point *place,
                          uint32_t ray)
{
    const struct bd_first_light *light = l->light;
    if (light->punctual_count > BD_FIRST_PUNCTUALS) {
        draw_punctuals(l, place, ray);
        return;
    }
    for (uint32_t i = 0; i < light->punctual_count; i++)
        ask_punctual(l, place, &light->punctuals[i], light_of_punctual(light, i, place), ray + i);
}

// --- emitters and the sky -----------------------------------------------------------------------

static void ask_areas(const struct lighting *l, const struct bd_surface_point *place, uint32_t ray)
{
    const struct bd_area_receiver at = {
        .position = place->position,
        .normal = place->normal,
        .normal_geometric = place->normal,
        .viewer = place->normal,
        .triangle = place->triangle,
        .place = place->number,
    };
    struct bd_area_light_found found[AREA_RAYS] = {0};
    struct bd_area_shares shares = {0};
    bd_area_sample(&l->sampling, &at, 1, l->segments + ray, found, NULL, &shares);
    for (uint32_t i = 0; i < AREA_RAYS; i++) l->brought[ray + i] = found[i].irradiance;
}

// --- all ----------------------------------------------------------------------------------------

static void ask_group(void *user, uint32_t group)
{
    const struct lighting *l = user;
    const uint32_t punctuals = punctuals_asked(l->light);
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES; i++) {
        const size_t first = (size_t)i * l->ray_count;
        memset(l->segments + first, 0, l->ray_count * sizeof *l->segments);
        memset(l->brought + first, 0, l->ray_count * sizeof *l->brought);
        if (i >= l->count) continue;
        ask_punctuals(l, &l->places[i], (uint32_t)first);
        if (l->light->lights) ask_areas(l, &l->places[i], (uint32_t)first + punctuals);
    }
}

static f3 way_of(const struct bd_segment *segment)
{
    const f3 way = f3_of(segment->to[0] - segment->from[0], segment->to[1] - segment->from[1],
                         segment->to[2] - segment->from[2]);
    const float length2 = f3_dot(way, way);
    return length2 > 0 ? f3_scale(way, 1 / f_sqrt(length2)) : way;
}

static bool is_brought(const struct lighting *l, uint32_t ray)
{
    return strongest_channel(l->brought[ray]) > 0 && !(l->occluded[ray / 32] >> ray % 32 & 1);
}

static f3 keep_ways(const struct lighting *l, uint32_t i)
{
    struct bd_first_way ways[BD_FIRST_PUNCTUALS + AREA_RAYS];
    uint32_t count = 0;
    for (uint32_t r = i * l->ray_count; r < (i + 1) * l->ray_count; r++)
        if (is_brought(l, r))
            ways[count++] = (struct bd_first_way){l->brought[r], way_of(&l->segments[r])};
    return l->light->keep(l->light->keeper, l->first + i, ways, count);
}

static void sum_irradiance(const struct lighting *l, uint32_t i)
{
    f3 sum = f3_of(0, 0, 0);
    float strength = 0, cosines = 0;
    for (uint32_t r = i * l->ray_count; r < (i + 1) * l->ray_count; r++) {
        if (!is_brought(l, r)) continue;
        const float weight = strongest_channel(l->brought[r]);
        sum = f3_add(sum, l->brought[r]);
        strength += weight;
        if (l->cosine)
            cosines += weight * f_max(f3_dot(l->places[i].normal, way_of(&l->segments[r])), 0);
    }
    l->irradiance[i] = l->light->keep ? keep_ways(l, i) : sum;
    if (l->cosine) l->cosine[i] = strength > 0 ? cosines / strength : 1;
}

// Irradiance is that of the triangle's own normal.
static void sum_reflected(const struct lighting *l, uint32_t i)
{
    const struct bd_first_looks *looks = l->looks;
    const struct bd_ray *ray = &looks->rays[l->first + i];
    const struct bd_ray_hit *hit = &looks->hits[l->first + i];
    const struct bd_reflecting s = bd_reflecting_at(looks->surfaces, &l->places[i], hit->u, hit->v);
    const f3 viewer = f3_of(-ray->direction[0], -ray->direction[1], -ray->direction[2]);
    const float roughness =
        roughness_over(patch_roughness(s.roughness), looks->spread_sr[l->first + i]);
    f3 sum = f3_of(0, 0, 0);
    for (uint32_t r = i * l->ray_count; r < (i + 1) * l->ray_count; r++) {
        if (!is_brought(l, r)) continue;
        const f3 way = way_of(&l->segments[r]);
        const float bent = bd_bent(s.normal, s.normal_geometric, way);
        const f3 brdf =
            gltf_brdf(s.base_color, s.metallic, roughness, s.f0_dielectric, s.normal, way, viewer);
        sum = f3_add(sum, f3_scale(f3_mul(l->brought[r], brdf), bent));
    }
    looks->reflected[l->first + i] = sum;
    l->irradiance[i] = f3_of(0, 0, 0);
    if (l->cosine) l->cosine[i] = 1;
}

static void sum_group(void *user, uint32_t group)
{
    const struct lighting *l = user;
    for (uint32_t i = group * BD_LANES; i < (group + 1) * BD_LANES && i < l->count; i++) {
        if (l->looks && l->looks->are[l->first + i] && l->places[i].triangle != BD_NO_TRIANGLE)
            sum_reflected(l, i);
        else
            sum_irradiance(l, i);
    }
}

static enum bd_err light_some(struct lighting *l, const struct bd_visibility_inputs *visibility,
                              struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    const uint32_t groups = (l->count + BD_LANES - 1) / BD_LANES;
    const double units = UNITS_PER_PLACE + UNITS_PER_PUNCTUAL * l->light->punctual_count;
    bd_slicer_work(l->context->slicer, "first light");
    enum bd_err err = bd_receivers_each(l->context, groups, units * BD_LANES, ask_group, l);
    if (!err)
        err = bd_straight_ask(l->context, visibility, l->segments,
                              (size_t)groups * BD_LANES * l->ray_count, l->occluded, l->brought, 1,
                              traced, detail);
    bd_slicer_work(l->context->slicer, "first light");
    return err ? err
               : bd_receivers_each(l->context, groups, UNITS_PER_SUM * BD_LANES, sum_group, l);
}

static struct lighting lighting_of(const struct bd_pass_context *context,
                                   const struct bd_first_light *light, uint64_t seed)
{
    struct lighting l = {.context = context, .light = light};
    l.sequence = bd_sequence_of((uint32_t)(seed ^ seed >> 32), OF_PUNCTUALS);
    l.ray_count = punctuals_asked(light) + (light->lights ? AREA_RAYS : 0);
    if (!light->lights) return l;
    l.sampling = bd_area_sampling_of(light->lights, 2 * AREA_RAYS, seed ^ OF_PUNCTUALS);
    l.sampling.reach = 1.01f * (float)light->space->radius;
    l.sampling.from_cd_m2 = (float)(1 / light->space->unit_cd_m2);
    l.sampling.lambert = true;
    return l;
}

enum bd_err bd_first_light_run(const struct bd_pass_context *context,
                               const struct bd_first_light *light,
                               const struct bd_visibility_inputs *visibility, uint64_t seed,
                               const struct bd_surface_point *places, uint32_t count,
                               const struct bd_first_looks *looks, f3 *irradiance, float *cosine,
                               struct bd_ray_counts *traced, struct bd_err_detail *detail)
{
    struct lighting l = lighting_of(context, light, seed);
    const uint32_t most = count < AT_ONCE ? count : AT_ONCE;
    const size_t rays = (size_t)((most + BD_LANES - 1) / BD_LANES) * BD_LANES * l.ray_count;
    enum bd_err err = BD_ERR_OK;
    l.segments = malloc((rays + 1) * sizeof *l.segments);
    l.brought = malloc((rays + 1) * sizeof *l.brought);
    l.occluded = malloc((rays / 32 + 1) * sizeof *l.occluded);
    if (!l.segments || !l.brought || !l.occluded)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "far_rays", "no memory for %zu rays", rays);
    l.looks = looks;
    for (l.first = 0; !err && l.first < count; l.first += l.count) {
        l.places = places + l.first;
        l.irradiance = irradiance + l.first;
        l.cosine = cosine ? cosine + l.first : NULL;
        l.count = count - l.first < AT_ONCE ? count - l.first : AT_ONCE;
        err = light_some(&l, visibility, traced, detail);
    }
    free(l.segments);
    free(l.brought);
    free(l.occluded);
    return err;
}
