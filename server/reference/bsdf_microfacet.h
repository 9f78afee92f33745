// GGX microfacets and Fresnel's terms: the pieces of bsdf.c, apart for tests of closed forms.
//
// Inline: small, and called several times for each direction. Local frame: z along the shading
// normal, `o` to the eye. Any thread.

#ifndef BD_REFERENCE_BSDF_MICROFACET_H
#define BD_REFERENCE_BSDF_MICROFACET_H

#include <math.h>

#include "reference/vec3f.h"

// Cosines to the eye below this count as this, as the raster techniques have it: a normal map may
// put the eye into the surface's plane or behind it.
#define BD_GGX_COSINE_MIN 1e-4f

// A lobe narrower than this is beyond what directions in 32 bits resolve well (hazard 16).
#define BD_GGX_ALPHA_MIN 1e-3f

// alpha = roughness^2; exactly 0 for roughness 0, a mirror, otherwise at least 1e-3 (hazard 16).
static inline float bd_ggx_alpha(float roughness)
{
    return roughness <= 0 ? 0 : bd_maxf(roughness * roughness, BD_GGX_ALPHA_MIN);
}

// (1 - cosine)^5 of Schlick's approximation.
static inline float bd_schlick_grazing(float cosine)
{
    float x = bd_minf(bd_maxf(1 - cosine, 0), 1), x2 = x * x;
    return x2 * x2 * x;
}

// Fresnel's reflectance of a smooth dielectric for unpolarised light; `eta`: index on the far side
// by the index on the side of the light. 1 under total reflection, and where eta is not positive
// and finite (KHR_materials_ior's 0 reflects everything).
static inline float bd_fresnel_dielectric(float cosine, float eta)
{
    if (!(eta > 0) || !isfinite(eta)) return 1;
    float c = bd_minf(bd_maxf(cosine, 0), 1);
    float sin2 = (1 - c * c) / (eta * eta);
    if (sin2 >= 1) return 1;
    float cos_t = sqrtf(1 - sin2);
    float parallel = (eta * c - cos_t) / (eta * c + cos_t);
    float perpendicular = (c - eta * cos_t) / (c + eta * cos_t);
    return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

// D(h), 1/sr, for unit h above the surface; without cancellation for small alpha.
//
// h.z^2 (alpha^2 - 1) + 1 = sin^2 + (alpha cos)^2, with the sine from the components across the
// normal: the usual form subtracts two numbers close to 1.
static inline float bd_ggx_distribution(const float h[3], float alpha)
{
    float sin2 = h[0] * h[0] + h[1] * h[1], a2 = alpha * alpha;
    float d = sin2 + h[2] * h[2] * a2;
    return a2 / (BD_PI_F * d * d);
}

// The root in Smith's terms for a direction with that cosine to the normal.
static inline float bd_ggx_smith(float cosine, float alpha)
{
    float a2 = alpha * alpha;
    return sqrtf(cosine * cosine * (1 - a2) + a2);
}

// Smith's G1.
static inline float bd_ggx_masking(float cosine, float alpha)
{
    float c = bd_maxf(cosine, 1e-12f);
    return 2 * c / (c + bd_ggx_smith(c, alpha));
}

// A normal visible from `o` (Heitz 2018, Sampling the GGX Distribution of Visible Normals).
// `cos_o` stands for |o.z|. Its pdf per steradian of h is G1(cos_o) D(h) max(o.h, 0) / cos_o,
// with cos_o for o.z.
static inline void bd_ggx_sample_visible(const float o[3], float cos_o, float alpha,
                                         const float u[2], float h[3])
{
    // The hemisphere's configuration: the ellipsoid stretched to a sphere.
    float v[3] = {alpha * o[0], alpha * o[1], cos_o};
    bd_vec3f_normalize(v);
    float across = v[0] * v[0] + v[1] * v[1];
    float t1[3] = {1, 0, 0}, t2[3];
    if (across > 0) {
        float s = 1 / sqrtf(across);
        bd_vec3f_set(t1, -v[1] * s, v[0] * s, 0);
    }
    bd_vec3f_cross(t2, v, t1);
    // A point of the disc as projected from v.
    float r = sqrtf(u[0]), phi = 2 * BD_PI_F * u[1];
    float p1 = r * cosf(phi), p2 = r * sinf(phi), s = 0.5f * (1 + v[2]);
    p2 = (1 - s) * sqrtf(bd_maxf(1 - p1 * p1, 0)) + s * p2;
    float p3 = sqrtf(bd_maxf(1 - p1 * p1 - p2 * p2, 0));
    for (int k = 0; k < 3; k++) h[k] = p1 * t1[k] + p2 * t2[k] + p3 * v[k];
    bd_vec3f_set(h, alpha * h[0], alpha * h[1], bd_maxf(h[2], 1e-6f));
    bd_vec3f_normalize(h);
}

#endif
