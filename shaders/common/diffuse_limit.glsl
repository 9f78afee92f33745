// How bright the diffuse lobe of glTF's dielectric can be without gain (hazard 18).
//
// Appendix B mixes the diffuse and the GGX lobe by Schlick's term of the half vector. Under grazing
// angles the two then add up to more than what arrives: to 1.8 times as much for white and smooth
// at a cosine of .03. A diffuse colour no brighter than this keeps the sum at 1, for any f0.
//
// Of one direction under `cosine` to the normal; grows with it, but for the error. Fitted to
// quadrature by diffuse_limit.py, which derives it: where it is below 1, within .003 from a cosine
// of .01 on, and .02 below that.

float diffuse_limit(float cosine, float roughness)
{
    float c = cosine, r = roughness;
    float above = r * (0.03177 + r * 0.68887) +
                  c * (-0.10461 + r * r * 1.32955 + c * (0.98520 - r * 3.11719 - c * 1.22549));
    float below = 1.0 + r * (-1.55819 + r * 3.92978) + c * 0.88820;
    // 1 - t: fifth root of what Schlick's term takes from the furnace by way of the GGX lobe.
    float t = sqrt(max(c * c + r * above / below, 0.0));
    float rest = max(1.0 - t, 0.0), rest2 = rest * rest;
    float brightening = 1.02886 + c * (-0.08135 + c * (0.08139 - c * 0.02898));
    return (1.0 - rest2 * rest2 * rest) * brightening;
}
