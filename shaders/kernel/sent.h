// What glTF's BRDF (Appendix B) returns in all of light that is the same from all sides, each
// direction weighed by its cosine; or, as light goes both ways, what it sends to whoever looks from
// everywhere.
//
// The GGX lobe returns f0 (A - B) + B, Schlick's term split as by Karis (2013): A is what it
// returns with a Fresnel term of 1, less than all since light that meets a rough surface twice is
// lost to the model; B with (1 - v.h)^5. Both are fits of degree 4 to 400,000 samples for each of 21
// roughnesses, within .0022 and .0006. The diffuse lobe returns what Schlick's term leaves,
// (1 - f0)(1 - .0037). Without the limit of bright colours at grazing angles
// (kernel/diffuse_limit.h).
#ifndef BD_KERNEL_SENT_H
#define BD_KERNEL_SENT_H

#include "kernel/math.h"

KERNEL float lobe_sent_white(float r)
{
    return 0.9996f + r * (-0.0069f + r * (0.2928f + r * (-2.1343f + r * 1.2598f)));
}

KERNEL float lobe_sent_grazing(float r)
{
    return 0.0471f + r * (0.0422f + r * (-0.4207f + r * (0.5596f - r * 0.2257f)));
}

// The mean of (1 - v.h)^5 over light that is the same from all sides, under the cosine of v: within
// .00012 of it.
KERNEL float diffuse_grazing(float c)
{
    return 0.02805f + c * (-0.07734f + c * (0.07495f - c * 0.02569f));
}

// What a dielectric's diffuse lobe returns to who looks under that cosine.
KERNEL f3 sent_by_diffuse(f3 color, float f0_dielectric, float cosine)
{
    return f3_scale(color, (1.0f - f0_dielectric) * (1.0f - diffuse_grazing(cosine)));
}

// Of a lobe that returns so much; `diffuse`: the colour below it, as far as it is no metal's.
KERNEL f3 sent_by_lobes(f3 base_color, f3 diffuse, float metallic, float f0_dielectric, float white,
                        float grazing)
{
    float dielectric = 1.0f - metallic, straight = white - grazing;
    float coat = dielectric * (f0_dielectric * straight + grazing) + metallic * grazing;
    f3 below = f3_add(f3_scale(diffuse, dielectric * (1.0f - f0_dielectric) * (1.0f - 0.0037f)),
                      f3_scale(base_color, metallic * straight));
    return f3_add(below, f3_of(coat, coat, coat));
}

KERNEL f3 sent_from_everywhere(f3 base_color, float metallic, float roughness, float f0_dielectric)
{
    return sent_by_lobes(base_color, base_color, metallic, f0_dielectric,
                         lobe_sent_white(roughness), lobe_sent_grazing(roughness));
}

#endif
