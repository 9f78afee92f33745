// Light that comes straight from lights of all kinds to places on surfaces, wherever they are: what
// rays that met something ask about it. Of at most BD_FIRST_PUNCTUALS punctual lights each is
// asked, of more as many, drawn by what they would give; emitters and the sky get two rays
// (pass/area_samples.h).
//
// Unbiased. Private to pass/. Cost: six rays a place at most, and every punctual light is weighed
// there.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_FIRST_LIGHT_H
#define BD_PASS_FIRST_LIGHT_H

#include "lights/area_lights.h"
#include "lights/point_lobes.h"
#include "pass/visibility.h"
#include "shared/light.h"

#define BD_FIRST_PUNCTUALS 4u

struct bd_render_space;

struct bd_first_light {
    const struct bd_area_lights *lights; // NULL: none
    const struct bd_light_uniform *punctuals;
    uint32_t punctual_count;
    const struct bd_render_space *space;
    // Of each punctual light the square of the distance within which others bring its light
    // (pass/near_lamps.h); NULL: nobody does.
    const float *near2;
    // Takes the ways by which light comes to a place, a number among `places`, and returns the
    // irradiance that is left to tell (lights/point_lobes.h). NULL: all of it is told.
    f3 (*keep)(void *keeper, uint32_t place, const struct bd_first_way *ways, uint32_t count);
    void *keeper;
};

// Places that someone looks at, by the rays that met them.
struct bd_first_looks {
    const struct bd_surface_hits *surfaces;
    const struct bd_ray *rays;
    const struct bd_ray_hit *hits;
    const bool *are; // else it is as if nobody looked
    const float *spread_sr; // that each ray stands for
    // What goes back along the ray by the whole BRDF, lobes no narrower than patch_roughness and
    // than what the ray stands for, or single rays would bring more than their share; for
    // lights that a ray is drawn to as surfaces see them, under normals as they are interpolated.
    // Places that it is told of get no irradiance.
    f3 *reflected;
};

// `irradiance` of each place, in the frame's unit, and if asked for (not NULL) the cosine under
// which it comes there, weighed by how much. `looks`: NULL, nobody does. Places' numbers are
// their own. In slices of their own.
BD_MUST_CHECK
enum bd_err bd_first_light_run(const struct bd_pass_context *context,
                               const struct bd_first_light *light,
                               const struct bd_visibility_inputs *visibility, uint64_t seed,
                               const struct bd_surface_point *places, uint32_t count,
                               const struct bd_first_looks *looks, f3 *irradiance, float *cosine,
                               struct bd_ray_counts *traced, struct bd_err_detail *detail);

#endif
