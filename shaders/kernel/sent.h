// What glTF's BRDF (Appendix B) returns in all of light that is the same from all sides, each
// direction weighed by its cosine; or, as light goes both ways, what it sends to whoever looks from
// everywhere.
//
// The GGX lobe returns f0 (A - B) + B, Schlick's term split as by Karis (2013): A is what it
// returns with a Fresnel term of 1, less than all since light that meets a rough surface twice is
// lost to the model; B with (1 - v.h)^5. Both are fits of degree 4 to 400,000 samples for each of
// 21 roughnesses, within .0022 and .0006. The diffuse lobe returns what Schlick's term leaves, (1 -
// f0)(1 - .0037) of its colour as it is limited (kernel/diffuse_limit.h).
#ifndef BD_KERNEL_SENT_H
#define BD_KERNEL_SENT_H

#include "kernel/diffuse_limit.h"

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
    return sent_by_lobes(base_color, diffuse_limited_of_all(base_color, roughness), metallic,
                         f0_dielectric, lobe_sent_white(roughness), lobe_sent_grazing(roughness));
}

// The GGX lobe's two parts to who looks under that cosine, of roughnesses from .6 on: fits in the
// root of the cosine to 65,536 samples, within .011 and .0014 (lights/sent_albedo.py fits).
KERNEL float rough_sent_white(float r, float c)
{
    float s = f_sqrt(c);
    return 1.0120f + 0.0232f * r +
           s * (0.0880f - 0.9021f * r + s * (0.1092f - 0.3434f * r + s * (0.4159f - 0.1059f * r)));
}

KERNEL float rough_sent_grazing(float r, float c)
{
    float s = f_sqrt(c);
    float second = -1.4577f + r * (2.0200f - 0.8734f * r);
    float third = 0.1320f + r * (1.1405f - 0.7245f * r);
    float fourth = 0.7949f + r * (-2.2439f + 1.1889f * r);
    return 0.5331f + r * (-0.9439f + 0.4603f * r) +
           s * (0.0178f - r * (0.0188f + 0.0266f * r) + s * (second + s * (third + s * fourth)));
}

// What a rough dielectric returns to who looks under that cosine; `color` of its diffuse lobe.
KERNEL f3 sent_by_rough(f3 color, float roughness, float f0_dielectric, float cosine)
{
    float grazing = rough_sent_grazing(roughness, cosine);
    float lobe = f0_dielectric * (rough_sent_white(roughness, cosine) - grazing) + grazing;
    return f3_add(sent_by_diffuse(color, f0_dielectric, cosine), f3_of(lobe, lobe, lobe));
}

#endif
