// The glTF 2.0 BRDF (its Appendix B): a Lambertian lobe and a GGX lobe mixed by Schlick's Fresnel
// term. Directions are unit, n is the normal, l goes to the light and v to the viewer.
//
// What departs from Appendix B: the diffuse lobe is no brighter than either direction allows, so
// that no surface gives more light than it gets (hazard 18), and f stays reciprocal.
//
// Known: D(h) divides by (n.h^2 (a^2 - 1) + 1)^2, which cancels in 32 bits for small a; 1 - n.h^2
// is therefore taken from the cross product (hazard 16).
#ifndef BD_KERNEL_BRDF_H
#define BD_KERNEL_BRDF_H

#include "kernel/diffuse_limit.h"

// GGX alpha of a perceptual roughness; below 1e-3 the lobe is narrower than fp32 can sample.
KERNEL float ggx_alpha(float roughness)
{
    return f_max(roughness * roughness, 1e-3f);
}

// A direction's cosine as Smith's term and the diffuse lobe's limit take it: of the light, and of
// the viewer, whom a bent normal may have behind it.
KERNEL float light_cosine(f3 n, f3 l)
{
    return f_max(f3_dot(n, l), 0.0f);
}
KERNEL float view_cosine(f3 n, f3 v)
{
    return f_max(f_abs(f3_dot(n, v)), 1e-4f);
}

// Of a direction, in Smith's height-correlated visibility.
KERNEL float smith_root(float cosine, float alpha)
{
    float a2 = alpha * alpha;
    return f_sqrt(cosine * cosine * (1.0f - a2) + a2);
}

// D V, V = G / (4 n.l n.v). view_root = smith_root of n_v: the same for all lights.
KERNEL float ggx_lobe(f3 n, f3 h, float n_l, float n_v, float alpha, float view_root)
{
    float n_h = f_max(f3_dot(n, h), 0.0f), a2 = alpha * alpha;
    f3 across = f3_cross(n, h);
    float d = f3_dot(across, across) + n_h * n_h * a2;
    float smith = n_l * view_root + n_v * smith_root(n_l, alpha);
    return 0.5f * a2 / (F_PI * d * d * f_max(smith, 1e-12f));
}

// f(l, v) in 1/sr, without the cosine; 0 below the horizon is the caller's. n_v and view_root as
// above.
KERNEL f3 brdf_of_view(f3 base_color, float metallic, float roughness, float f0_dielectric, f3 n,
                       f3 l, f3 v, float n_v, float view_root)
{
    f3 sum = f3_add(l, v);
    float sum2 = f3_dot(sum, sum), n_l = light_cosine(n, l);
    f3 h = f3_select(sum2 > 0.0f, f3_scale(sum, 1.0f / f_sqrt(f_max(sum2, 1e-37f))), n);
    float grazing = f_fifth(f_min(f_max(1.0f - f3_dot(v, h), 0.0f), 1.0f));
    float specular = ggx_lobe(n, h, n_l, n_v, ggx_alpha(roughness), view_root);
    float fresnel = f0_dielectric + (1.0f - f0_dielectric) * grazing;
    // The limit grows with the cosine: the smaller one is that of the flatter direction.
    float limit = diffuse_limit(f_min(n_l, n_v), roughness);
    // Per unit of each: white, the diffuse lobe's colour, and the metal's.
    float white = specular * ((1.0f - metallic) * fresnel + metallic * grazing);
    float diffuse = (1.0f - metallic) * (1.0f - fresnel) * (1.0f / F_PI);
    float metal = specular * metallic * (1.0f - grazing);
    f3 colours = f3_add(f3_scale(f3_min(base_color, limit), diffuse), f3_scale(base_color, metal));
    return f3_add(colours, f3_of(white, white, white));
}

KERNEL f3 gltf_brdf(f3 base_color, float metallic, float roughness, float f0_dielectric, f3 n, f3 l,
                    f3 v)
{
    float n_v = view_cosine(n, v);
    return brdf_of_view(base_color, metallic, roughness, f0_dielectric, n, l, v, n_v,
                        smith_root(n_v, ggx_alpha(roughness)));
}

// brdf=lambert.
KERNEL f3 lambert_brdf(f3 base_color)
{
    return f3_of(base_color.x / F_PI, base_color.y / F_PI, base_color.z / F_PI);
}

// The specular lobe cannot be integrated over a patch: its peak is held to what a patch can send.
KERNEL float patch_roughness(float roughness)
{
    return f_max(roughness, 0.25f);
}

// Of light from so many steradians, taken in one direction: a lobe that is narrower is as wide as
// they are, so that it reflects no more than comes. Half vectors turn half as far as directions do.
KERNEL float roughness_over(float roughness, float solid_angle_sr)
{
    float a2 = roughness * roughness * roughness * roughness;
    return f_min(f_sqrt(f_sqrt(a2 + solid_angle_sr / (4.0f * F_PI))), 1.0f);
}

// What it reflects beyond base colour / pi, per irradiance; `roughness` a patch's. Negative away
// from highlights, where Fresnel's term and the limit take more from the diffuse lobe than the
// specular one gives. Not to be held to 0: a conference room came out 8 % too bright.
KERNEL f3 beyond_diffuse_of_view(f3 base_color, float metallic, float roughness,
                                 float f0_dielectric, f3 n, f3 l, f3 v, float n_v, float view_root)
{
    f3 all = brdf_of_view(base_color, metallic, roughness, f0_dielectric, n, l, v, n_v, view_root);
    return f3_sub(all, f3_scale(base_color, (1.0f - metallic) / F_PI));
}

KERNEL f3 beyond_diffuse(f3 base_color, float metallic, float roughness, float f0_dielectric, f3 n,
                         f3 l, f3 v)
{
    float rough = patch_roughness(roughness), n_v = view_cosine(n, v);
    return beyond_diffuse_of_view(base_color, metallic, rough, f0_dielectric, n, l, v, n_v,
                                  smith_root(n_v, ggx_alpha(rough)));
}

#endif
