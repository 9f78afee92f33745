// What is left for the diffuse lobe of glTF's dielectric (hazard 18).
//
// Appendix B mixes the diffuse and the GGX lobe by Schlick's term of the half vector. Under grazing
// angles the two then add up to more than what arrives: to 1.8 times as much for white and smooth
// at a cosine of .03, to 1.1 times at roughness .5. The diffuse lobe is therefore scaled by a
// factor of each of the two directions, the smaller one, which keeps it reciprocal. The factor is 1
// where nothing can be gained: for a base colour of .8, at cosines above .23 and at every one from
// roughness .5 on; for .5, above .12 and from roughness .25 on. The raster techniques have a fit of
// their own to the same integrals (shaders/kernel/diffuse_limit.h), within .006 / pi of this from a
// cosine of .02 on.
//
// Any thread; no state.

#ifndef BD_REFERENCE_BSDF_ALBEDO_H
#define BD_REFERENCE_BSDF_ALBEDO_H

#include <stdbool.h>

// True if the factor is 1 for every direction.
bool bd_albedo_is_plain(const float base_color[3], float roughness);

// Factors in [0, 1] by colour for one direction under `cosine` to the normal.
void bd_albedo_diffuse_factor(const float base_color[3], float roughness, float cosine,
                              float out[3]);

#endif
