#include "scene/model/render_space.h"

#include <math.h>

// The power of two at or below x, for x > 0; 1 for what has no logarithm.
static double power_of_two_below(double x)
{
    if (!(x > 0) || !isfinite(x)) return 1.0;
    int exponent;
    frexp(x, &exponent);
    return ldexp(1.0, exponent - 1);
}

static double strongest_channel(const float color[3])
{
    return fmax(color[0], fmax(color[1], color[2]));
}

// The strongest light as the radiance scale of the scene that it lights: illuminance at one
// render unit for point and spot, at normal incidence for directional.
static double strongest_light(const struct bd_scene *scene, double render_per_m)
{
    double strongest = 0;
    for (uint32_t i = 0; i < scene->placed_light_count; i++) {
        const struct bd_light *light = &scene->lights[scene->placed_lights[i].object];
        double value = light->intensity * strongest_channel(light->color);
        if (light->kind != BD_LIGHT_DIRECTIONAL) value *= render_per_m * render_per_m;
        strongest = fmax(strongest, value);
    }
    if (strongest > 0) return strongest;
    for (uint32_t i = 0; i < scene->material_count; i++)
        strongest = fmax(strongest, strongest_channel(scene->materials[i].emissive));
    return strongest;
}

struct bd_render_space bd_render_space_of(const struct bd_scene *scene)
{
    const struct bd_features *f = &scene->features;
    struct bd_render_space space;
    space.origin_m = bd_scene_origin_m(f);
    space.render_per_m = 1.0 / power_of_two_below(f->diagonal_m);
    space.unit_cd_m2 = power_of_two_below(strongest_light(scene, space.render_per_m));
    // A margin: the origin is not quite in the middle, and vertices are rounded to 32 bits.
    space.radius = 0.5 * f->diagonal_m * space.render_per_m * 1.004;
    return space;
}
