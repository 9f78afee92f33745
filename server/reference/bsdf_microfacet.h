// GGX microfacets and Fresnel's terms: the pieces of bsdf.c, apart for tests of closed forms.
//
// Local frame: z along the shading normal, `o` to the eye. Any thread.

#ifndef BD_REFERENCE_BSDF_MICROFACET_H
#define BD_REFERENCE_BSDF_MICROFACET_H

// Cosines to the eye below this count as this, as the raster techniques have it: a normal map may
// put the eye into the surface's plane or behind it.
#define BD_GGX_COSINE_MIN 1e-4f

// alpha = roughness^2; exactly 0 for roughness 0, a mirror, otherwise at least 1e-3 (hazard 16).
float bd_ggx_alpha(float roughness);

// (1 - cosine)^5 of Schlick's approximation.
float bd_schlick_grazing(float cosine);

// Fresnel's reflectance of a smooth dielectric for unpolarised light; `eta`: index on the far side
// by the index on the side of the light. 1 under total reflection, and where eta is not positive
// and finite (KHR_materials_ior's 0 reflects everything).
float bd_fresnel_dielectric(float cosine, float eta);

// D(h), 1/sr, for unit h above the surface; without cancellation for small alpha.
float bd_ggx_distribution(const float h[3], float alpha);

// Smith's G1 for a direction with that cosine to the normal.
float bd_ggx_masking(float cosine, float alpha);

// Smith's height-correlated G2 / (4 cos_i cos_o).
float bd_ggx_visibility(float cos_i, float cos_o, float alpha);

// A normal visible from `o` (Heitz 2018, Sampling the GGX Distribution of Visible Normals).
// `cos_o` stands for |o.z|.
void bd_ggx_sample_visible(const float o[3], float cos_o, float alpha, const float u[2],
                           float h[3]);

// Its density per steradian of h; `d` is D(h).
float bd_ggx_visible_density(const float o[3], float cos_o, const float h[3], float d, float alpha);

#endif
