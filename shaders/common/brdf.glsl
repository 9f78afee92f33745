// The glTF 2.0 BRDF (its Appendix B): a Lambertian lobe and a GGX lobe mixed by Schlick's
// Fresnel term. BD_LAMBERT drops the specular lobe and the metallic split: f = base colour / pi.
//
// What departs from Appendix B: the diffuse lobe is no brighter than either direction allows, so
// that no surface gives more light than it gets (hazard 18), and f stays reciprocal.
//
// Known: D(h) divides by (n.h^2 (a^2 - 1) + 1)^2, which cancels in 32 bits for small a; 1 - n.h^2
// is therefore taken from the cross product (hazard 16).

#include "common/diffuse_limit.glsl"
#include "common/pi.glsl"

// GGX alpha of a perceptual roughness; below 1e-3 the lobe is narrower than fp32 can sample.
float ggx_alpha(float roughness) { return max(roughness * roughness, 1e-3); }

float ggx_distribution(vec3 n, vec3 h, float alpha)
{
    float n_h = max(dot(n, h), 0.0);
    vec3 across = cross(n, h);
    float d = dot(across, across) + n_h * n_h * alpha * alpha;
    return alpha * alpha / (PI * d * d);
}

// Smith's height-correlated visibility, G / (4 n.l n.v).
float ggx_visibility(float n_l, float n_v, float alpha)
{
    float a2 = alpha * alpha;
    float v = n_l * sqrt(n_v * n_v * (1.0 - a2) + a2) + n_v * sqrt(n_l * n_l * (1.0 - a2) + a2);
    return 0.5 / max(v, 1e-12);
}

// f(l, v) in 1/sr, without the cosine. n, l, v unit; 0 below the horizon is the caller's.
vec3 brdf(vec3 base_color, float metallic, float roughness, float f0_dielectric, vec3 n, vec3 l,
          vec3 v)
{
#ifdef BD_LAMBERT
    return base_color / PI;
#else
    vec3 h = l + v;
    h = dot(h, h) > 0.0 ? normalize(h) : n;
    float alpha = ggx_alpha(roughness);
    float grazing = pow(clamp(1.0 - dot(v, h), 0.0, 1.0), 5.0);
    float n_l = max(dot(n, l), 0.0);
    float n_v = max(abs(dot(n, v)), 1e-4);
    float specular = ggx_distribution(n, h, alpha) * ggx_visibility(n_l, n_v, alpha);
    float fresnel_dielectric = mix(f0_dielectric, 1.0, grazing);
    // The limit grows with the cosine: the smaller one is that of the flatter direction.
    vec3 diffuse = min(base_color, diffuse_limit(min(n_l, n_v), roughness)) / PI;
    vec3 dielectric = mix(diffuse, vec3(specular), fresnel_dielectric);
    vec3 metal = specular * mix(base_color, vec3(1.0), grazing);
    return mix(dielectric, metal, metallic);
#endif
}
