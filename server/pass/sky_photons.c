#include "pass/sky_photons.h"

#include <math.h>

#include "kernel/all_channels.h"
#include "lights/directions.h"
#include "lights/sequence.h"

#define LOOKS 1024u
// Of the radius: rays start beyond all that lies on the sphere.
#define BEFORE 1.01f

// A direction to the sky, and the radiance that stands for all of it, times steradians.
static f3 choose(const struct bd_sky_photons *p, const float number[2], f3 *direction)
{
    float pdf = 1 / (4 * F_PI);
    *direction = p->sky->columns > 0 ? bd_sky_light_choose(p->sky, number, &pdf)
                                     : bd_direction_at(1 - 2 * number[0], number[1]);
    if (!(pdf > 0)) return f3_of(0, 0, 0);
    return f3_scale(bd_sky_light_radiance(p->sky, *direction), p->from_cd_m2 / pdf);
}

static float disc_area(const struct bd_sky_photons *p)
{
    return F_PI * p->radius * p->radius;
}

double bd_sky_photons_flux(const struct bd_sky_photons *photons)
{
    const struct bd_sequence sequence = bd_sequence_of(0, 0);
    double sum = 0;
    for (uint32_t i = 0; i < LOOKS; i++) {
        float number[2];
        f3 direction;
        bd_sequence_pair(&sequence, i, number);
        sum += strongest_channel(choose(photons, number, &direction));
    }
    return sum / LOOKS * disc_area(photons);
}

struct bd_ray bd_sky_photons_ray(const struct bd_sky_photons *photons, const float way[2],
                                 const float place[2], f3 *flux)
{
    f3 to_sky;
    *flux = f3_scale(choose(photons, way, &to_sky), disc_area(photons));
    const struct bd_basis basis = bd_basis_of(to_sky);
    const float radius = photons->radius * f_sqrt(place[0]), turn = 2 * F_PI * place[1];
    const f3 from = bd_from_basis(
        &basis, to_sky, f3_of(radius * cosf(turn), radius * sinf(turn), BEFORE * photons->radius));
    return (struct bd_ray){.origin = {from.x, from.y, from.z},
                           .from_triangle = BD_NO_TRIANGLE,
                           .direction = {-to_sky.x, -to_sky.y, -to_sky.z},
                           .far = INFINITY};
}
