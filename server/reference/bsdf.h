// How a surface scatters light: glTF's metallic-roughness BRDF, its Lambertian part alone, or a
// dielectric that transmits. Evaluation, sampling and pdf agree with each other.
//
// glTF 2.0 Appendix B (diffuse and GGX mixed by Schlick's Fresnel), KHR_materials_ior,
// KHR_materials_transmission, KHR_materials_volume; sampling of visible normals after Heitz 2018;
// rough dielectrics after Walter et al. 2007. What departs from Appendix B:
//
// - the diffuse lobe is lowered where the sum of both would reflect more than arrives
//   (bsdf_albedo.h);
// - roughness 0 is a mirror, a delta lobe: a punctual light has no highlight on it. Any other
//   roughness counts as at least .032 (alpha 1e-3), as in the raster techniques (hazard 16);
// - what a solid transmits follows Snell and the exact Fresnel terms, base colour at each passage.
//
// Values are for radiance: what passes into a solid grows by its index squared and shrinks again as
// it leaves. Only a camera or a punctual light inside of a solid sees the difference (a furnace of
// 1 shows 2.25 in glass).
//
// Directions are unit, in world space, and point away from the surface: `wo` to the eye, `wi` to
// where the light comes from. Any thread; no state.

#ifndef BD_REFERENCE_BSDF_H
#define BD_REFERENCE_BSDF_H

#include <stdbool.h>

#include "reference/vec3f.h"

// Everything about one point of a surface that shading reads. Both normals are unit and on the side
// of `wo`, as the raster techniques have them.
struct bd_surface {
    float normal_geometric[3], normal[3]; // geometric; shading
    float base_color[3];
    float metallic, roughness; // perceptual roughness
    float ior;                 // of the solid, 1.5 unless said
    float transmission;        // share of the diffuse lobe that passes instead
    bool thin;                 // no volume: transmitted light is not refracted
    bool entering;             // `wo` is outside of the solid
    float emission[3];         // cd/m^2, towards `wo`
    bool unlit;                // reflects nothing, and `emission` is for the camera's own rays
    bool lambert;              // only base_color / pi
};

// A surface as seen from one direction. The surface is the caller's; the rest, what all evaluations
// and samples from there have in common, is bd_bsdf_look's. Directions are in the frame of the
// shading normal, z along it.
struct bd_bsdf {
    struct bd_surface surface;
    float x[3], y[3], z[3]; // axes in world space
    float o[3];             // to the eye, local
    float cos_o;            // |o.z|, never quite 0
    float alpha;            // 0: the microfacets are a mirror
    float f0;
    // Shares of the three materials that glTF mixes. They add up to 1.
    float opaque, transmissive, metal;
    float smith_o;            // sqrt(cos_o^2 (1 - alpha^2) + alpha^2), of Smith's terms
    float masking_over_cos_o; // Smith's G1 of the eye's direction
    bool diffuse_is_plain;    // bsdf_albedo.h: all factors are 1
    float diffuse_factor[3];  // of the eye's direction
    float micro_probability;  // of choosing the microfacet lobe, else the diffuse one
    bool delta_reflection, delta_transmission;
};

// Looks at bsdf->surface from `wo`, which must be the direction that the surface was made for.
void bd_bsdf_look(struct bd_bsdf *bsdf, const float wo[3]);

struct bd_bsdf_sample {
    float wi[3];
    // f |cos| / pdf: the two multiply to what bd_bsdf_eval gives, to the last bits, since the
    // pdf is that of the whole mixture, not of the lobe that was chosen.
    float weight[3];
    float pdf;       // per steradian; 0 for a delta lobe
    bool delta;      // smooth: direction by a point mass
    bool transmitted;
};

// f(wo, wi) x |cos(wi, shading normal)| in `out`, and the pdf with which bd_bsdf_sample would
// have chosen wi, per steradian (NULL: not wanted, which is quicker). Delta lobes contribute
// nothing to either. Zero where the geometric and the shading normal disagree about the side of wi
// (hazard 61).
void bd_bsdf_eval(const struct bd_bsdf *bsdf, const float wi[3], float out[3], float *pdf);

// False if bd_bsdf_eval is zero for sure: `wi` is behind the surface, or nothing is reflected. Most
// light that is sought is told apart here, before a ray is spent on it.
static inline bool bd_bsdf_is_reached(const struct bd_surface *s, const float wi[3])
{
    if (s->transmission > 0) return true;
    if (s->lambert && s->base_color[0] + s->base_color[1] + s->base_color[2] == 0) return false;
    return bd_vec3f_dot(s->normal_geometric, wi) > 0 &&
           (bd_vec3f_dot(s->normal, wi) > 0 || s->roughness <= 0);
}

// `u`: three independent uniform numbers in [0, 1). False: the sample is absorbed.
bool bd_bsdf_sample(const struct bd_bsdf *bsdf, const float u[3], struct bd_bsdf_sample *out);

// What passes straight on to `wo`, of each colour, and the chance with which bd_bsdf_sample would
// have let it. False: nothing does, or not straight. Smooth thin walls alone.
bool bd_bsdf_straight(const struct bd_bsdf *bsdf, float out[3], float *chance);

// True if every lobe is a delta lobe: nothing can be evaluated, only sampled.
static inline bool bd_bsdf_is_delta(const struct bd_surface *surface)
{
    if (surface->lambert || surface->roughness > 0) return false;
    return (1 - surface->metallic) * (1 - surface->transmission) == 0;
}

#endif
