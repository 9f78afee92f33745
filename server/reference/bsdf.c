#include "reference/bsdf.h"

#include <math.h>
#include <stddef.h>

#include "reference/bsdf_albedo.h"
#include "reference/bsdf_microfacet.h"
#include "reference/vec3f.h"

// The share of samples that each of two lobes gets at least: what the estimate of their albedos
// below does not know (masking, a half vector far from the normal) cannot make a weight explode.
#define SHARE_MIN 0.1f

// Rough transmission spreads directions by about alpha |ior - 1|. Below this 32 bits cannot tell
// the half vector of two directions that all but oppose each other.
#define REFRACTION_SPREAD_MIN 2e-5f

// --- a surface as seen from one direction ---------------------------------------------------

static float f0_of_ior(float ior)
{
    float r = (ior - 1) / (ior + 1);
    return r * r;
}

static float mean_of_metal(const float base_color[3], float grazing)
{
    float mean = bd_vec3f_mean(base_color);
    return mean + (1 - mean) * grazing;
}

// Reflectance of the transmissive share: a thin wall's is glTF's, a solid's must be exact, since
// Schlick's form knows no total reflection from within.
static float transmissive_fresnel(const struct bd_bsdf *bsdf, float cosine, float grazing)
{
    const struct bd_surface *s = &bsdf->surface;
    if (s->thin) return bsdf->f0 + (1 - bsdf->f0) * grazing;
    return bd_fresnel_dielectric(cosine, s->entering ? s->ior : 1 / s->ior);
}

// Chances in proportion to what the lobes would reflect if all microfacets lay in the surface.
static float micro_probability_of(const struct bd_bsdf *bsdf)
{
    if (bsdf->opaque == 0) return 1;
    const float *base = bsdf->surface.base_color;
    float grazing = bd_schlick_grazing(bsdf->cos_o);
    float fresnel = bsdf->f0 + (1 - bsdf->f0) * grazing;
    float left = bd_vec3f_dot(base, bsdf->diffuse_factor) / 3;
    float diffuse = bsdf->opaque * (1 - fresnel) * left;
    float micro =
        bsdf->opaque * fresnel + bsdf->metal * mean_of_metal(base, grazing) + bsdf->transmissive;
    if (diffuse <= 0) return 1;
    float share = micro / (micro + diffuse);
    return bd_minf(bd_maxf(share, SHARE_MIN), 1 - SHARE_MIN);
}

void bd_bsdf_look(struct bd_bsdf *bsdf, const float wo[3])
{
    const struct bd_surface *s = &bsdf->surface;
    if (s->lambert) return;
    bsdf->metal = s->metallic;
    bsdf->transmissive = (1 - s->metallic) * s->transmission;
    bsdf->opaque = (1 - s->metallic) * (1 - s->transmission);
    bsdf->alpha = bd_ggx_alpha(s->roughness);
    bsdf->f0 = f0_of_ior(s->ior);
    bsdf->delta_reflection = bsdf->alpha == 0;
    bsdf->delta_transmission =
        bsdf->alpha == 0 || (!s->thin && bsdf->alpha * fabsf(s->ior - 1) < REFRACTION_SPREAD_MIN);
    // A normal map may turn the normal away from the eye. What can only be met by sampling would
    // then be lost altogether, so it falls back to the triangle's own normal.
    bool needs_side = bsdf->delta_reflection || bsdf->transmissive > 0;
    bool away = bd_vec3f_dot(s->normal, wo) <= 0;
    bd_vec3f_copy(bsdf->z, needs_side && away ? s->normal_geometric : s->normal);
    bd_vec3f_frame(bsdf->z, bsdf->x, bsdf->y);
    bd_vec3f_set(bsdf->o, bd_vec3f_dot(wo, bsdf->x), bd_vec3f_dot(wo, bsdf->y),
                 bd_vec3f_dot(wo, bsdf->z));
    bsdf->cos_o = bd_maxf(fabsf(bsdf->o[2]), BD_GGX_COSINE_MIN);
    bsdf->smith_o = bd_ggx_smith(bsdf->cos_o, bsdf->alpha);
    bsdf->masking_over_cos_o = 2 / (bsdf->cos_o + bsdf->smith_o);
    bsdf->diffuse_is_plain = bd_albedo_is_plain(s->base_color, s->roughness);
    bd_vec3f_set(bsdf->diffuse_factor, 1, 1, 1);
    if (bsdf->opaque > 0 && !bsdf->diffuse_is_plain)
        bd_albedo_diffuse_factor(s->base_color, s->roughness, bsdf->cos_o, bsdf->diffuse_factor);
    bsdf->micro_probability = micro_probability_of(bsdf);
}

static void to_world(const struct bd_bsdf *bsdf, const float local[3], float out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = bsdf->x[k] * local[0] + bsdf->y[k] * local[1] + bsdf->z[k] * local[2];
}

// --- microfacets ------------------------------------------------------------------------------

// What one microfacet does with light that meets it under the angle between `o` and its normal.
struct facet {
    float reflected[3]; // by colour
    float through;      // share transmitted, before the base colour's tint
    float q;            // probability of following the reflection
    float opaque_fresnel;
};

static inline struct facet facet_at(const struct bd_bsdf *bsdf, float cosine)
{
    struct facet facet;
    const float *base = bsdf->surface.base_color;
    float grazing = bd_schlick_grazing(cosine);
    facet.opaque_fresnel = bsdf->f0 + (1 - bsdf->f0) * grazing;
    float transmissive = 0;
    if (bsdf->transmissive > 0) transmissive = transmissive_fresnel(bsdf, cosine, grazing);
    float common = bsdf->opaque * facet.opaque_fresnel + bsdf->transmissive * transmissive;
    for (int k = 0; k < 3; k++)
        facet.reflected[k] = common + bsdf->metal * (base[k] + (1 - base[k]) * grazing);
    facet.through = bsdf->transmissive * (1 - transmissive);
    facet.q = 1;
    float through = facet.through * bd_vec3f_mean(base);
    if (through > 0) {
        float reflected = bd_vec3f_mean(facet.reflected);
        facet.q = reflected / (reflected + through);
    }
    return facet;
}

// Smith's height-correlated G2 / (4 cos_i cos_o).
static float visibility(const struct bd_bsdf *bsdf, float cos_i)
{
    float v = cos_i * bsdf->smith_o + bsdf->cos_o * bd_ggx_smith(cos_i, bsdf->alpha);
    return 0.5f / bd_maxf(v, 1e-12f);
}

// One pair of directions: f |cos| and pdf, to be added to.
struct value {
    float f_cos[3], pdf;
    bool wants_pdf;
};

static void diffuse_reflection(const struct bd_bsdf *bsdf, float fresnel, float cos_i, float out[3])
{
    const struct bd_surface *s = &bsdf->surface;
    bd_vec3f_scale(out, s->base_color, bsdf->opaque * (1 - fresnel) * (1 / BD_PI_F));
    if (bsdf->diffuse_is_plain) return;
    float factor[3];
    bd_albedo_diffuse_factor(s->base_color, s->roughness, cos_i, factor);
    for (int k = 0; k < 3; k++) out[k] *= bd_minf(factor[k], bsdf->diffuse_factor[k]);
}

// With which sampling of visible normals finds the reflection at `h`: D G1 o.h / (cos_o 4 o.h),
// where the first o.h is the configuration's, whose cosine to the eye is never 0.
static float reflection_pdf(const struct bd_bsdf *bsdf, const float h[3], float o_h, float d)
{
    float pdf = 0.25f * d * bsdf->masking_over_cos_o;
    float raised = bsdf->cos_o - bsdf->o[2];
    return raised == 0 ? pdf : pdf * (1 + raised * h[2] / o_h);
}

static void add_reflection(const struct bd_bsdf *bsdf, const float i[3], struct value *to)
{
    float h[3] = {bsdf->o[0] + i[0], bsdf->o[1] + i[1], bsdf->o[2] + i[2]};
    if (!bd_vec3f_normalize(h)) return;
    float o_h = bd_vec3f_dot(bsdf->o, h);
    struct facet facet = facet_at(bsdf, o_h);
    float diffuse[3] = {0, 0, 0}, specular = 0;
    if (bsdf->opaque > 0) diffuse_reflection(bsdf, facet.opaque_fresnel, i[2], diffuse);
    // The half vector lies below the surface only if the normal map turned the eye behind it.
    if (!bsdf->delta_reflection && h[2] > 0 && o_h > 0) {
        float d = bd_ggx_distribution(h, bsdf->alpha);
        specular = d * visibility(bsdf, i[2]);
        if (to->wants_pdf)
            to->pdf += bsdf->micro_probability * facet.q * reflection_pdf(bsdf, h, o_h, d);
    }
    for (int k = 0; k < 3; k++) to->f_cos[k] += (diffuse[k] + facet.reflected[k] * specular) * i[2];
}

// A rough thin wall: the reflected lobe mirrored through the surface, as KHR_materials_transmission
// has it.
static void add_thin_transmission(const struct bd_bsdf *bsdf, const float i[3], struct value *to)
{
    float mirrored[3] = {i[0], i[1], -i[2]};
    float h[3] = {bsdf->o[0] + mirrored[0], bsdf->o[1] + mirrored[1], bsdf->o[2] + mirrored[2]};
    if (!bd_vec3f_normalize(h)) return;
    float o_h = bd_vec3f_dot(bsdf->o, h);
    if (o_h <= 0) return;
    struct facet facet = facet_at(bsdf, o_h);
    float d = bd_ggx_distribution(h, bsdf->alpha);
    float f = facet.through * d * visibility(bsdf, mirrored[2]);
    for (int k = 0; k < 3; k++) to->f_cos[k] += bsdf->surface.base_color[k] * f * mirrored[2];
    to->pdf += bsdf->micro_probability * (1 - facet.q) * reflection_pdf(bsdf, h, o_h, d);
}

// Refractive indices on the sides of `wo` and of the transmitted direction.
static void indices(const struct bd_surface *s, float *eta_o, float *eta_i)
{
    *eta_o = s->entering ? 1 : s->ior;
    *eta_i = s->entering ? s->ior : 1;
}

// Walter et al. 2007, equations 16, 17 and 21.
static void add_solid_transmission(const struct bd_bsdf *bsdf, const float i[3], struct value *to)
{
    float eta_o, eta_i, h[3];
    indices(&bsdf->surface, &eta_o, &eta_i);
    for (int k = 0; k < 3; k++) h[k] = bsdf->o[k] * eta_o + i[k] * eta_i;
    if (!bd_vec3f_normalize(h)) return;
    if (h[2] < 0) bd_vec3f_scale(h, h, -1);
    float o_h = bd_vec3f_dot(bsdf->o, h), i_h = bd_vec3f_dot(i, h);
    if (o_h <= 0 || i_h >= 0) return;
    struct facet facet = facet_at(bsdf, o_h);
    float d = bd_ggx_distribution(h, bsdf->alpha);
    float across = eta_o * o_h + eta_i * i_h;
    float spread = -i_h / (across * across);
    float visible = bsdf->masking_over_cos_o * (o_h + (bsdf->cos_o - bsdf->o[2]) * h[2]) * d;
    float masking = bd_ggx_masking(-i[2], bsdf->alpha);
    float f = facet.through * eta_o * eta_o * spread * visible * masking;
    for (int k = 0; k < 3; k++) to->f_cos[k] += bsdf->surface.base_color[k] * f;
    to->pdf += bsdf->micro_probability * (1 - facet.q) * eta_i * eta_i * spread * visible;
}

// --- evaluation -------------------------------------------------------------------------------

static void evaluate(const struct bd_bsdf *bsdf, const float i[3], struct value *to)
{
    if (i[2] > 0) {
        add_reflection(bsdf, i, to);
        to->pdf += (1 - bsdf->micro_probability) * i[2] / BD_PI_F;
    } else if (i[2] < 0 && bsdf->transmissive > 0 && !bsdf->delta_transmission) {
        if (bsdf->surface.thin)
            add_thin_transmission(bsdf, i, to);
        else
            add_solid_transmission(bsdf, i, to);
    }
}

static void evaluate_lambert(const struct bd_surface *s, const float wi[3], float out[3],
                             float *pdf)
{
    float cosine = bd_vec3f_dot(s->normal, wi);
    bool above = cosine > 0 && bd_vec3f_dot(s->normal_geometric, wi) > 0;
    *pdf = above ? cosine / BD_PI_F : 0;
    bd_vec3f_scale(out, s->base_color, *pdf);
}

// Light stays on the side where the geometry says that it is (hazard 61).
static bool sides_agree(const struct bd_bsdf *bsdf, const float i[3], const float wi[3])
{
    float geometric = bd_vec3f_dot(bsdf->surface.normal_geometric, wi);
    return i[2] > 0 ? geometric > 0 : i[2] < 0 && geometric < 0;
}

static struct value value_of(const struct bd_bsdf *bsdf, const float i[3], const float wi[3],
                             bool wants_pdf)
{
    struct value value = {{0, 0, 0}, 0, wants_pdf};
    if (sides_agree(bsdf, i, wi)) evaluate(bsdf, i, &value);
    if (!isfinite(value.pdf) || !isfinite(bd_vec3f_mean(value.f_cos)))
        return (struct value){{0, 0, 0}, 0, wants_pdf};
    return value;
}

void bd_bsdf_eval(const struct bd_bsdf *bsdf, const float wi[3], float out[3], float *pdf)
{
    const struct bd_surface *surface = &bsdf->surface;
    float unused;
    if (!pdf) pdf = &unused;
    if (surface->lambert) {
        evaluate_lambert(surface, wi, out, pdf);
        return;
    }
    bd_vec3f_set(out, 0, 0, 0);
    *pdf = 0;
    if (!bd_bsdf_is_reached(surface, wi)) return;
    float i[3] = {bd_vec3f_dot(wi, bsdf->x), bd_vec3f_dot(wi, bsdf->y), bd_vec3f_dot(wi, bsdf->z)};
    struct value value = value_of(bsdf, i, wi, pdf != &unused);
    bd_vec3f_copy(out, value.f_cos);
    *pdf = value.pdf;
}

// --- sampling ---------------------------------------------------------------------------------

static void cosine_direction(const float u[2], float out[3])
{
    float r = sqrtf(u[0]), phi = 2 * BD_PI_F * u[1];
    bd_vec3f_set(out, r * cosf(phi), r * sinf(phi), sqrtf(bd_maxf(1 - u[0], 0)));
}

static bool sample_lambert(const struct bd_surface *s, const float u[3], struct bd_bsdf_sample *out)
{
    float local[3], x[3], y[3];
    cosine_direction(u, local);
    bd_vec3f_frame(s->normal, x, y);
    for (int k = 0; k < 3; k++)
        out->wi[k] = x[k] * local[0] + y[k] * local[1] + s->normal[k] * local[2];
    bd_vec3f_copy(out->weight, s->base_color);
    out->pdf = bd_vec3f_dot(s->normal, out->wi) / BD_PI_F;
    out->delta = out->transmitted = false;
    return out->pdf > 0 && bd_vec3f_dot(s->normal_geometric, out->wi) > 0;
}

// Snell's law at a facet `h` on the side of `o`. False: total reflection.
static bool refract(const float o[3], const float h[3], float eta_o, float eta_i, float out[3])
{
    float ratio = eta_o / eta_i, cos_o = bd_vec3f_dot(o, h);
    float sin2 = ratio * ratio * bd_maxf(1 - cos_o * cos_o, 0);
    if (!(sin2 < 1)) return false;
    bd_vec3f_scale(out, o, -ratio);
    bd_vec3f_add_scaled(out, out, h, ratio * cos_o - sqrtf(1 - sin2));
    return bd_vec3f_normalize(out);
}

static bool transmit(const struct bd_bsdf *bsdf, const float h[3], float out[3])
{
    float o_h = bd_vec3f_dot(bsdf->o, h);
    if (!bsdf->surface.thin) {
        float eta_o, eta_i;
        indices(&bsdf->surface, &eta_o, &eta_i);
        return refract(bsdf->o, h, eta_o, eta_i, out);
    }
    for (int k = 0; k < 3; k++) out[k] = 2 * o_h * h[k] - bsdf->o[k];
    out[2] = -out[2];
    return true;
}

// Radiance is compressed by the square of the indices' ratio as it passes (header).
static float radiance_scale(const struct bd_surface *s)
{
    if (s->thin) return 1;
    return s->entering ? 1 / (s->ior * s->ior) : s->ior * s->ior;
}

static bool finish_delta(const struct bd_bsdf *bsdf, const struct facet *facet, bool through,
                         struct bd_bsdf_sample *out)
{
    float pdf = bsdf->micro_probability * (through ? 1 - facet->q : facet->q);
    if (through)
        bd_vec3f_scale(out->weight, bsdf->surface.base_color,
                       facet->through * radiance_scale(&bsdf->surface) / pdf);
    else
        bd_vec3f_scale(out->weight, facet->reflected, 1 / pdf);
    out->pdf = 0;
    out->delta = true;
    return true;
}

static bool finish_smooth(const struct bd_bsdf *bsdf, const float i[3], struct bd_bsdf_sample *out)
{
    struct value value = value_of(bsdf, i, out->wi, true);
    if (!(value.pdf > 0)) return false;
    bd_vec3f_scale(out->weight, value.f_cos, 1 / value.pdf);
    out->pdf = value.pdf;
    out->delta = false;
    return isfinite(bd_vec3f_mean(out->weight));
}

// `choice`: uniform in [0, 1), what is left of the third number.
static bool sample_micro(const struct bd_bsdf *bsdf, const float u[3], float choice,
                         struct bd_bsdf_sample *out)
{
    float h[3] = {0, 0, 1}, i[3];
    bool mirror = bsdf->delta_reflection;
    if (!mirror) bd_ggx_sample_visible(bsdf->o, bsdf->cos_o, bsdf->alpha, u, h);
    float o_h = bd_vec3f_dot(bsdf->o, h);
    if (o_h <= 0) return false;
    struct facet facet = facet_at(bsdf, o_h);
    bool through = choice >= facet.q;
    if (through && bsdf->delta_transmission && !mirror) {
        // Refraction too weak to spread: all facets let it pass as the surface itself would, with
        // the transmittance of the facet that was met.
        bd_vec3f_set(h, 0, 0, 1);
        mirror = true;
    }
    if (through && !transmit(bsdf, h, i)) return false;
    if (!through)
        for (int k = 0; k < 3; k++) i[k] = 2 * o_h * h[k] - bsdf->o[k];
    out->transmitted = through;
    to_world(bsdf, i, out->wi);
    if ((i[2] > 0) == through || !sides_agree(bsdf, i, out->wi)) return false;
    return mirror ? finish_delta(bsdf, &facet, through, out) : finish_smooth(bsdf, i, out);
}

static bool sample_diffuse(const struct bd_bsdf *bsdf, const float u[3], struct bd_bsdf_sample *out)
{
    float i[3];
    cosine_direction(u, i);
    to_world(bsdf, i, out->wi);
    out->transmitted = false;
    return i[2] > 0 && finish_smooth(bsdf, i, out);
}

bool bd_bsdf_sample(const struct bd_bsdf *bsdf, const float u[3], struct bd_bsdf_sample *out)
{
    if (bsdf->surface.lambert) return sample_lambert(&bsdf->surface, u, out);
    float p = bsdf->micro_probability;
    if (u[2] < p) return sample_micro(bsdf, u, u[2] / p, out);
    return sample_diffuse(bsdf, u, out);
}

bool bd_bsdf_straight(const struct bd_bsdf *bsdf, float out[3], float *chance)
{
    const struct bd_surface *s = &bsdf->surface;
    if (s->lambert || !s->thin || s->roughness > 0 || !(bsdf->transmissive > 0)) return false;
    const struct facet facet = facet_at(bsdf, bsdf->o[2]);
    bd_vec3f_scale(out, s->base_color, facet.through);
    *chance = bsdf->micro_probability * (1 - facet.q);
    return out[0] > 0 || out[1] > 0 || out[2] > 0;
}
