// Punctual lights with a radius: paths that scatter into one find what no point can be found by,
// light that went through or off something smooth and is seen through or in it (L S+ D S+ E).
//
// A place sees such a light as a disc about its direction, and gets from each direction of it the
// same, together what it would get of the point. Both ways to find it, drawing a direction of the
// disc and scattering into it, share by the power heuristic (Veach 1997). The light hides nothing
// and is not seen by itself, nor in mirrors.

#include <math.h>

#include "reference/path.h"
#include "reference/vec3f.h"

// Smaller ones are points: what directions of 32 bits tell apart.
#define LEAST_SINE2 1e-12f

// The squared sine of the disc's half angle; 0: the light is a point to the place, which is within
// it, or too far away to tell.
static float sine2_of(const struct bd_path *path, float distance)
{
    const float r2 = path->lamp_radius * path->lamp_radius;
    if (isinf(distance)) { // a directional light's radius is told at one metre
        const double tangent = path->integrand->lamp_radius_m;
        const double sine2 = tangent * tangent / (1 + tangent * tangent);
        return sine2 < LEAST_SINE2 ? 0 : (float)sine2;
    }
    const float d2 = distance * distance;
    return r2 < d2 && r2 >= LEAST_SINE2 * d2 ? r2 / d2 : 0;
}

static float one_less_cosine(float sine2)
{
    return sine2 / (1 + sqrtf(1 - sine2));
}

static float steradians_of(float sine2)
{
    return 2 * BD_PI_F * one_less_cosine(sine2);
}

// Luminance of each direction, of what the point would give across it.
static float luminance_of(float sine2)
{
    return 1 / (BD_PI_F * sine2);
}

static void basis_of(const float z[3], float x[3], float y[3])
{
    const float axis[3] = {fabsf(z[0]) < 0.6f, fabsf(z[0]) >= 0.6f, 0};
    bd_vec3f_cross(x, axis, z);
    bd_vec3f_normalize(x);
    bd_vec3f_cross(y, z, x);
}

float bd_path_spread_lamp(struct bd_path *path, struct bd_illumination *light)
{
    const float sine2 = sine2_of(path, light->distance);
    if (!(sine2 > 0)) return 0;
    const float u = (float)(bd_sampler_hash(&path->sampler, path->ray_index++) >> 8) * 0x1p-24f;
    const float v = (float)(bd_sampler_hash(&path->sampler, path->ray_index++) >> 8) * 0x1p-24f;
    const float down = u * one_less_cosine(sine2), across = sqrtf(down * (2 - down));
    const float phi = 2 * BD_PI_F * v, steradians = steradians_of(sine2);
    float x[3], y[3];
    basis_of(light->direction, x, y);
    for (int k = 0; k < 3; k++)
        light->direction[k] =
            (1 - down) * light->direction[k] + across * (cosf(phi) * x[k] + sinf(phi) * y[k]);
    if (!isinf(light->distance)) {
        const float chord2 = path->lamp_radius * path->lamp_radius -
                             light->distance * light->distance * across * across;
        light->distance = (1 - down) * light->distance - sqrtf(bd_maxf(chord2, 0));
    }
    bd_vec3f_scale(light->normal_illuminance, light->normal_illuminance,
                   luminance_of(sine2) * steradians);
    return 1 / steradians;
}

// Of the one light, if the ray goes into it before `distance`.
static void add_lamp(struct bd_path *path, const struct bd_punctual *punctual,
                     const struct bd_vertex *from, const float direction[3], float distance)
{
    struct bd_illumination light;
    if (!bd_punctual_illuminates(&path->reference->punctuals, punctual, from->position, &light))
        return;
    const float sine2 = sine2_of(path, light.distance);
    if (!(sine2 > 0)) return;
    float across[3];
    bd_vec3f_cross(across, light.direction, direction);
    const float off2 = bd_vec3f_dot(across, across);
    if (!(off2 < sine2) || bd_vec3f_dot(light.direction, direction) <= 0) return;
    if (!isinf(light.distance) &&
        light.distance * (sqrtf(1 - off2) - sqrtf(sine2 - off2)) > distance)
        return;
    if (isinf(light.distance) && !isinf(distance)) return;
    const float weight =
        path->is_specular ? 1 : bd_path_power_weight(path->scatter_pdf, 1 / steradians_of(sine2));
    bd_vec3f_scale(light.normal_illuminance, light.normal_illuminance,
                   luminance_of(sine2) * weight);
    bd_path_add(path, path->events, light.normal_illuminance);
}

void bd_path_add_lamps(struct bd_path *path, const struct bd_vertex *from, const float direction[3],
                       float distance)
{
    const struct bd_punctuals *punctuals = &path->reference->punctuals;
    if (!(path->lamp_radius > 0) || path->only_mirrors) return;
    if (!(bd_path_lights(path, path->events) & BD_REFERENCE_PUNCTUAL)) return;
    for (uint32_t i = 0; i < punctuals->count; i++)
        add_lamp(path, &punctuals->punctuals[i], from, direction, distance);
}
