#include "reference/bsdf_microfacet.h"

#include <math.h>

#include "reference/vec3f.h"

// A lobe narrower than this is beyond what directions in 32 bits resolve well (hazard 16).
#define ALPHA_MIN 1e-3f

float bd_ggx_alpha(float roughness)
{
    return roughness <= 0 ? 0 : fmaxf(roughness * roughness, ALPHA_MIN);
}

float bd_schlick_grazing(float cosine)
{
    float x = fminf(fmaxf(1 - cosine, 0), 1), x2 = x * x;
    return x2 * x2 * x;
}

float bd_fresnel_dielectric(float cosine, float eta)
{
    if (!(eta > 0) || !isfinite(eta)) return 1;
    float c = fminf(fmaxf(cosine, 0), 1);
    float sin2 = (1 - c * c) / (eta * eta);
    if (sin2 >= 1) return 1;
    float cos_t = sqrtf(1 - sin2);
    float parallel = (eta * c - cos_t) / (eta * c + cos_t);
    float perpendicular = (c - eta * cos_t) / (c + eta * cos_t);
    return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

// h.z^2 (alpha^2 - 1) + 1 = sin^2 + (alpha cos)^2, with the sine from the components across the
// normal: the usual form subtracts two numbers close to 1.
float bd_ggx_distribution(const float h[3], float alpha)
{
    float sin2 = h[0] * h[0] + h[1] * h[1], a2 = alpha * alpha;
    float d = sin2 + h[2] * h[2] * a2;
    return a2 / (BD_PI_F * d * d);
}

float bd_ggx_masking(float cosine, float alpha)
{
    float c = fmaxf(cosine, 1e-12f), a2 = alpha * alpha;
    return 2 * c / (c + sqrtf(a2 + (1 - a2) * c * c));
}

float bd_ggx_visibility(float cos_i, float cos_o, float alpha)
{
    float a2 = alpha * alpha;
    float v =
        cos_i * sqrtf(cos_o * cos_o * (1 - a2) + a2) + cos_o * sqrtf(cos_i * cos_i * (1 - a2) + a2);
    return 0.5f / fmaxf(v, 1e-12f);
}

void bd_ggx_sample_visible(const float o[3], float cos_o, float alpha, const float u[2], float h[3])
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
    p2 = (1 - s) * sqrtf(fmaxf(1 - p1 * p1, 0)) + s * p2;
    float p3 = sqrtf(fmaxf(1 - p1 * p1 - p2 * p2, 0));
    for (int k = 0; k < 3; k++) h[k] = p1 * t1[k] + p2 * t2[k] + p3 * v[k];
    bd_vec3f_set(h, alpha * h[0], alpha * h[1], fmaxf(h[2], 1e-6f));
    bd_vec3f_normalize(h);
}

float bd_ggx_visible_density(const float o[3], float cos_o, const float h[3], float d, float alpha)
{
    float o_h = o[0] * h[0] + o[1] * h[1] + cos_o * h[2];
    return bd_ggx_masking(cos_o, alpha) * fmaxf(o_h, 0) * d / cos_o;
}
