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

#endif
