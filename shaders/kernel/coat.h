// What a virtual light of plastic sends to a place: its coat reflects light as it comes, and not
// evenly as what lies below does. Sent evenly, light that grazes a wall would return to the lamp's
// side (8 % of Sibenik's first reflection too much).
#ifndef BD_KERNEL_COAT_H
#define BD_KERNEL_COAT_H

#include "kernel/brdf.h"

// As if all of it were sent so evenly. `flux`: what is, to choose by; `even`: the coat's part of it
// for each of `coat_flux`, what comes to the coat along `way` (unit, to where it comes from).
// `minus_roughness`: below 0, as rough as a patch at least (patch_roughness), or there is none. n:
// the surface's normal; `to_vpl`: from the place.
KERNEL f3 flux_with_coat(f3 flux, f3 coat_flux, float even, float minus_roughness,
                         float f0_dielectric, f3 n, f3 way, f3 to_vpl, float r2)
{
    f3 v = f3_scale(to_vpl, -1.0f / f_sqrt(f_max(r2, 1e-37f)));
    f3 sum = f3_add(way, v);
    f3 h = f3_scale(sum, 1.0f / f_sqrt(f_max(f3_dot(sum, sum), 1e-37f)));
    float grazing = f_fifth(f_min(f_max(1.0f - f3_dot(v, h), 0.0f), 1.0f));
    float fresnel = f0_dielectric + (1.0f - f0_dielectric) * grazing;
    float alpha = ggx_alpha(-minus_roughness), n_v = view_cosine(n, v);
    float lobe = ggx_lobe(n, h, light_cosine(n, way), n_v, alpha, smith_root(n_v, alpha));
    bool above = b_and(f3_dot(n, v) > 0.0f, f3_dot(n, way) > 0.0f);
    float more = f_select(above, F_PI * lobe * fresnel, 0.0f) - even;
    more = f_select(minus_roughness < 0.0f, more, 0.0f);
    return f3_max(f3_add(flux, f3_scale(coat_flux, more)), 0.0f);
}

#endif
