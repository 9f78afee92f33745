// How bright the diffuse lobe of glTF's dielectric can be without gain (hazard 18).
//
// Appendix B mixes the diffuse and the GGX lobe by Schlick's term of the half vector. Under grazing
// angles the two then add up to more than what arrives: to 1.8 times as much for white and smooth
// at a cosine of .03. A diffuse colour no brighter than this keeps the sum at 1, for any f0.
//
// Of one direction under `cosine` to the normal; grows with it, but for the error. Fitted to
// quadrature by diffuse_limit.py, which derives it: where it is below 1, within .003 from a cosine
// of .01 on, and .02 below that.
#ifndef BD_KERNEL_DIFFUSE_LIMIT_H
#define BD_KERNEL_DIFFUSE_LIMIT_H

#include "kernel/math.h"

KERNEL float diffuse_limit(float cosine, float roughness)
{
    float c = cosine, r = roughness;
    float above = r * (0.03177f + r * 0.68887f) +
                  c * (-0.10461f + r * r * 1.32955f + c * (0.98520f - r * 3.11719f - c * 1.22549f));
    float below = 1.0f + r * (-1.55819f + r * 3.92978f) + c * 0.88820f;
    // 1 - t: fifth root of what Schlick's term takes from the furnace by way of the GGX lobe.
    float t = f_sqrt(f_max(c * c + r * above / below, 0.0f));
    float brightening = 1.02886f + c * (-0.08135f + c * (0.08139f - c * 0.02898f));
    return (1.0f - f_fifth(f_max(1.0f - t, 0.0f))) * brightening;
}

// A colour under that limit, which the flatter of two directions sets, in the mean over one of
// them, weighed by its cosine, where the other is under `cosine`: for who takes the lobe for an
// even one. By Gauss and Legendre, within .004.
KERNEL f3 diffuse_limited(f3 color, float roughness, float cosine)
{
    float c = cosine, flatter = c * c;
    f3 own = f3_min(color, diffuse_limit(c, roughness));
    f3 a = f3_min(color, diffuse_limit(0.0694318f * c, roughness));
    f3 b = f3_min(color, diffuse_limit(0.3300095f * c, roughness));
    f3 d = f3_min(color, diffuse_limit(0.6699905f * c, roughness));
    f3 e = f3_min(color, diffuse_limit(0.9305682f * c, roughness));
    f3 flat_ones = f3_add(f3_add(f3_scale(a, 0.0241522f), f3_scale(b, 0.2152141f)),
                          f3_add(f3_scale(d, 0.4369311f), f3_scale(e, 0.3237026f)));
    return f3_add(f3_scale(own, 1.0f - flatter), f3_scale(flat_ones, flatter));
}

// The same in the mean over both, within .006. Without it white that shines sent more than it got.
KERNEL f3 diffuse_limited_of_all(f3 color, float roughness)
{
    f3 a = f3_min(color, diffuse_limit(0.0469101f, roughness));
    f3 b = f3_min(color, diffuse_limit(0.2307653f, roughness));
    f3 c = f3_min(color, diffuse_limit(0.5f, roughness));
    f3 d = f3_min(color, diffuse_limit(0.7692347f, roughness));
    f3 e = f3_min(color, diffuse_limit(0.9530899f, roughness));
    f3 flat_ones = f3_add(f3_scale(a, 0.0221796f), f3_scale(b, 0.2091382f));
    f3 steep = f3_add(f3_scale(d, 0.3006378f), f3_scale(e, 0.0413777f));
    return f3_add(f3_add(flat_ones, f3_scale(c, 0.4266667f)), steep);
}

#endif
