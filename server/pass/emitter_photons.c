#include "pass/emitter_photons.h"

#include <math.h>

#include "kernel/lift.h"
#include "lights/directions.h"

static double flux_of(const struct bd_area_lights *lights, const struct bd_area_light *light)
{
    const double sides = lights->sources[light->source].two_sided ? 2 : 1;
    return sides * (double)F_PI * light->area * light->brightest;
}

static double flux_of_all(const struct bd_area_lights *lights)
{
    double flux = 0;
    for (uint32_t i = 0; lights && i < lights->count; i++)
        flux += flux_of(lights, &lights->lights[i]);
    return flux;
}

double bd_emitters_flux(const struct bd_area_lights *lights, float from_cd_m2)
{
    return from_cd_m2 * flux_of_all(lights);
}

struct bd_emitter_photons bd_emitter_photons_of(const struct bd_area_lights *lights, uint32_t count,
                                                float from_cd_m2, uint32_t seed, uint32_t purpose)
{
    struct bd_emitter_photons photons = {
        .lights = lights,
        .from_cd_m2 = from_cd_m2,
        .of_point = bd_sequence_of(seed, purpose),
        .of_direction = bd_sequence_of(seed, purpose + 1),
    };
    const double flux = flux_of_all(lights);
    if (!(flux > 0) || !isfinite(flux)) return photons;
    photons.count = count;
    photons.step = flux / count;
    return photons;
}

struct start {
    f3 position;
    float u, v; // barycentrics of the triangle
};

// Uniform over the part.
static struct start start_on(const struct bd_area_light *light, const float number[2])
{
    const float root = f_sqrt(number[0]), b = root * (1 - number[1]), c = root * number[1];
    const float a = 1 - b - c;
    const f3 *corner = light->corner;
    return (struct start){
        f3_add(f3_scale(corner[0], a), f3_add(f3_scale(corner[1], b), f3_scale(corner[2], c))),
        a * light->u[0] + b * light->u[1] + c * light->u[2],
        a * light->v[0] + b * light->v[1] + c * light->v[2]};
}

// Of two sides the first half of a part's photons leave the front.
static f3 side_of(const struct bd_emitter_photons *p, const struct bd_area_light *light,
                  double place)
{
    const bool is_back = p->lights->sources[light->source].two_sided &&
                         place - p->passed >= flux_of(p->lights, light) / 2;
    return is_back ? f3_scale(light->normal, -1) : light->normal;
}

bool bd_emitter_photons_next(struct bd_emitter_photons *p, struct bd_ray *ray, f3 *flux, f3 *normal)
{
    const struct bd_area_lights *lights = p->lights;
    if (p->next == p->count) return false;
    const double place = (p->next + 0.5) * p->step;
    while (p->light + 1 < lights->count &&
           place >= p->passed + flux_of(lights, &lights->lights[p->light]))
        p->passed += flux_of(lights, &lights->lights[p->light++]);
    const struct bd_area_light *light = &lights->lights[p->light];
    float number[2];
    bd_sequence_pair(&p->of_point, p->next, number);
    const struct start start = start_on(light, number);
    bd_sequence_pair(&p->of_direction, p->next++, number);
    *normal = side_of(p, light, place);
    const struct bd_basis basis = bd_basis_of(*normal);
    const f3 d = bd_from_basis(&basis, *normal, bd_cosine_direction(number));
    const f3 radiance = bd_area_emission_chosen(lights, light, start.u, start.v, d);
    *flux = f3_scale(radiance, p->from_cd_m2 * (float)(p->step / light->brightest));
    const float lift = lift_of_segment(0, start.position, start.position);
    const f3 from = f3_add(start.position, f3_scale(*normal, lift));
    *ray = (struct bd_ray){.origin = {from.x, from.y, from.z},
                           .from_triangle = light->triangle,
                           .direction = {d.x, d.y, d.z},
                           .far = INFINITY};
    return true;
}
