// What a surface sends on of light from everywhere, all directions together: for whoever takes it for
// a diffuse one of that colour.
//
// glTF's BRDF (Appendix B) under light that is the same from all sides, each direction weighed by its
// cosine. The GGX lobe returns f0 A + (1 - f0) B, Schlick's term split as by Karis (2013): A is what
// it returns with a Fresnel term of 1, which is less than all since light that meets the rough surface
// twice is lost to the model; B with (1 - v.h)^5. Both are fits of degree 4 to 400,000 samples for each
// of 21 roughnesses, within .0022 and .0006. The diffuse lobe returns what Schlick's term leaves,
// (1 - f0)(1 - .0037). Without the limit of bright colours at grazing angles (shaders/kernel/
// diffuse_limit.h). Any thread.

#ifndef BD_LIGHTS_SENT_H
#define BD_LIGHTS_SENT_H

#include "kernel/math.h"

static inline f3 bd_sent_by_all(f3 base_color, float metallic, float roughness, float f0_dielectric)
{
    const float r = roughness, dielectric = 1 - metallic;
    const float a = 0.9996f + r * (-0.0069f + r * (0.2928f + r * (-2.1343f + r * 1.2598f)));
    const float b = 0.0471f + r * (0.0422f + r * (-0.4207f + r * (0.5596f - r * 0.2257f)));
    const float coat = dielectric * (f0_dielectric * (a - b) + b) + metallic * b;
    const float below = dielectric * (1 - f0_dielectric) * (1 - 0.0037f) + metallic * (a - b);
    return f3_add(f3_scale(base_color, below), f3_of(coat, coat, coat));
}

#endif
