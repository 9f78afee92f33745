#include "pass/punctual_photons.h"

#include <math.h>

#include "kernel/light.h"
#include "lights/directions.h"
#include "pass/f3_arrays.h"

// What a cone is worth inside of its inner and between that and the outer one, over 2 pi: the
// attenuation there is the square of how far in it is.
struct cone {
    float cos_outer, rim, inside; // `rim`: the difference of the cosines
};

static struct cone cone_of(const struct bd_light_uniform *punctual)
{
    const float rim = 1 / punctual->per_cosine;
    return (struct cone){punctual->cos_outer, rim, 1 - punctual->cos_outer - rim};
}

// The cosine before which this part of the cone's light lies, counted from its edge.
static float cosine_in_cone(const struct cone *cone, float part)
{
    const float of_rim = cone->rim / 3, wanted = part * (of_rim + cone->inside);
    if (wanted < of_rim) return cone->cos_outer + cone->rim * cbrtf(wanted / of_rim);
    return f_min(cone->cos_outer + cone->rim + (wanted - of_rim), 1);
}

f3 bd_punctual_flux(const struct bd_light_uniform *punctual)
{
    const f3 intensity = f3_from(&punctual->intensity);
    const struct cone cone = cone_of(punctual);
    switch (punctual->kind) {
    case BD_LIGHT_KIND_DIRECTIONAL:
        return f3_scale(intensity, 4 * punctual->half_width * punctual->half_height);
    case BD_LIGHT_KIND_SPOT:
        return f3_scale(intensity, 2 * F_PI * (cone.rim / 3 + cone.inside));
    default:
        return f3_scale(intensity, 4 * F_PI);
    }
}

f3 bd_punctual_irradiance(const struct bd_light_uniform *punctual, f3 position, f3 normal)
{
    const f3 direction = f3_from(&punctual->direction), intensity = f3_from(&punctual->intensity);
    if (punctual->kind == BD_LIGHT_KIND_DIRECTIONAL)
        return f3_scale(intensity, f_max(-f3_dot(normal, direction), 0));
    const f3 span = f3_sub(f3_from(&punctual->position), position);
    const float distance = f_sqrt(f_max(f3_dot(span, span), 1e-30f));
    const float cosine = f_max(f3_dot(normal, span), 0) / distance;
    return f3_scale(intensity,
                    cosine * irradiance_at(span, direction, punctual->cos_outer,
                                           punctual->per_cosine, punctual->inverse_range));
}

static struct bd_ray ray_of(f3 origin, f3 direction)
{
    return (struct bd_ray){.origin = {origin.x, origin.y, origin.z},
                           .from_triangle = BD_NO_TRIANGLE,
                           .direction = {direction.x, direction.y, direction.z},
                           .far = INFINITY};
}

struct bd_ray bd_punctual_ray(const struct bd_light_uniform *punctual, const float number[2])
{
    const f3 position = f3_from(&punctual->position), ahead = f3_from(&punctual->direction);
    const struct bd_basis basis = {f3_from(&punctual->axis_x), f3_from(&punctual->axis_y)};
    if (punctual->kind == BD_LIGHT_KIND_DIRECTIONAL) {
        const float across = (2 * number[0] - 1) * punctual->half_width;
        const float up = (2 * number[1] - 1) * punctual->half_height;
        const f3 from = bd_from_basis(&basis, ahead, f3_of(across, up, 0));
        return ray_of(f3_add(position, from), ahead);
    }
    const struct cone cone = cone_of(punctual);
    const float cosine =
        punctual->kind == BD_LIGHT_KIND_SPOT ? cosine_in_cone(&cone, number[0]) : 2 * number[0] - 1;
    return ray_of(position, bd_from_basis(&basis, ahead, bd_direction_at(cosine, number[1])));
}
