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

// Directions in the frame of the shading normal: z along the normal.
struct view {
    const struct bd_surface *surface;
    float x[3], y[3], z[3]; // axes in world space
    float o[3];             // to the eye, local
    float cos_o;            // |o.z|, never quite 0
    float alpha;            // 0: the microfacets are a mirror
    float f0;
    // Shares of the three materials that glTF mixes. They add up to 1.
    float opaque, transmissive, metal;
    float diffuse_factor[3]; // bsdf_albedo.h, of the eye's direction
    float micro_probability; // of choosing the microfacet lobe, else the diffuse one
    bool delta_reflection, delta_transmission, wants_density;
};

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
static float transmissive_fresnel(const struct view *view, float cosine, float grazing)
{
    const struct bd_surface *s = view->surface;
    if (s->thin) return view->f0 + (1 - view->f0) * grazing;
    return bd_fresnel_dielectric(cosine, s->entering ? s->ior : 1 / s->ior);
}

// Chances in proportion to what the lobes would reflect if all microfacets lay in the surface.
static float micro_probability_of(const struct view *view)
{
    if (view->opaque == 0) return 1;
    const float *base = view->surface->base_color;
    float grazing = bd_schlick_grazing(view->cos_o);
    float fresnel = view->f0 + (1 - view->f0) * grazing;
    float left = bd_vec3f_dot(base, view->diffuse_factor) / 3;
    float diffuse = view->opaque * (1 - fresnel) * left;
    float micro =
        view->opaque * fresnel + view->metal * mean_of_metal(base, grazing) + view->transmissive;
    if (diffuse <= 0) return 1;
    float share = micro / (micro + diffuse);
    return bd_minf(bd_maxf(share, SHARE_MIN), 1 - SHARE_MIN);
}

static void view_begin(const struct bd_surface *s, const float wo[3], bool wants_density,
                       struct view *view)
{
    view->wants_density = wants_density;
    view->surface = s;
    view->metal = s->metallic;
    view->transmissive = (1 - s->metallic) * s->transmission;
    view->opaque = (1 - s->metallic) * (1 - s->transmission);
    view->alpha = bd_ggx_alpha(s->roughness);
    view->f0 = f0_of_ior(s->ior);
    view->delta_reflection = view->alpha == 0;
    view->delta_transmission =
        view->alpha == 0 || (!s->thin && view->alpha * fabsf(s->ior - 1) < REFRACTION_SPREAD_MIN);
    // A normal map may turn the normal away from the eye. What can only be met by sampling would
    // then be lost altogether, so it falls back to the triangle's own normal.
    bool needs_side = view->delta_reflection || view->transmissive > 0;
    bool away = bd_vec3f_dot(s->normal, wo) <= 0;
    bd_vec3f_copy(view->z, needs_side && away ? s->normal_geometric : s->normal);
    bd_vec3f_frame(view->z, view->x, view->y);
    bd_vec3f_set(view->o, bd_vec3f_dot(wo, view->x), bd_vec3f_dot(wo, view->y),
                 bd_vec3f_dot(wo, view->z));
    view->cos_o = bd_maxf(fabsf(view->o[2]), BD_GGX_COSINE_MIN);
    if (view->opaque > 0)
        bd_albedo_diffuse_factor(s->base_color, s->roughness, view->cos_o, view->diffuse_factor);
    view->micro_probability = wants_density ? micro_probability_of(view) : 0;
}

static void to_world(const struct view *view, const float local[3], float out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = view->x[k] * local[0] + view->y[k] * local[1] + view->z[k] * local[2];
}

// --- microfacets ------------------------------------------------------------------------------

// What one microfacet does with light that meets it under the angle between `o` and its normal.
struct facet {
    float reflected[3]; // by colour
    float through;      // share transmitted, before the base colour's tint
    float q;            // probability of following the reflection
    float opaque_fresnel;
};

static struct facet facet_at(const struct view *view, float cosine)
{
    struct facet facet;
    const float *base = view->surface->base_color;
    float grazing = bd_schlick_grazing(cosine);
    facet.opaque_fresnel = view->f0 + (1 - view->f0) * grazing;
    float transmissive = 0;
    if (view->transmissive > 0) transmissive = transmissive_fresnel(view, cosine, grazing);
    float common = view->opaque * facet.opaque_fresnel + view->transmissive * transmissive;
    for (int k = 0; k < 3; k++)
        facet.reflected[k] = common + view->metal * (base[k] + (1 - base[k]) * grazing);
    facet.through = view->transmissive * (1 - transmissive);
    float reflected = bd_vec3f_mean(facet.reflected);
    float through = facet.through * bd_vec3f_mean(base);
    facet.q = through > 0 ? reflected / (reflected + through) : 1;
    return facet;
}

// One pair of directions: f |cos| and density, to be added to.
struct value {
    float f_cos[3], density;
};

static void diffuse_reflection(const struct view *view, float fresnel, float cos_i, float out[3])
{
    const struct bd_surface *s = view->surface;
    float factor[3], scale = view->opaque * (1 - fresnel) / BD_PI_F;
    bd_albedo_diffuse_factor(s->base_color, s->roughness, cos_i, factor);
    for (int k = 0; k < 3; k++)
        out[k] = s->base_color[k] * scale * bd_minf(factor[k], view->diffuse_factor[k]);
}

static void add_reflection(const struct view *view, const float i[3], struct value *to)
{
    float h[3] = {view->o[0] + i[0], view->o[1] + i[1], view->o[2] + i[2]};
    if (!bd_vec3f_normalize(h)) return;
    float o_h = bd_vec3f_dot(view->o, h);
    struct facet facet = facet_at(view, o_h);
    float diffuse[3] = {0, 0, 0}, specular = 0;
    if (view->opaque > 0) diffuse_reflection(view, facet.opaque_fresnel, i[2], diffuse);
    // The half vector lies below the surface only if the normal map turned the eye behind it.
    if (!view->delta_reflection && h[2] > 0 && o_h > 0) {
        float d = bd_ggx_distribution(h, view->alpha);
        specular = d * bd_ggx_visibility(i[2], view->cos_o, view->alpha);
        if (view->wants_density)
            to->density += view->micro_probability * facet.q *
                           bd_ggx_visible_density(view->o, view->cos_o, h, d, view->alpha) /
                           (4 * o_h);
    }
    for (int k = 0; k < 3; k++) to->f_cos[k] += (diffuse[k] + facet.reflected[k] * specular) * i[2];
}

// A rough thin wall: the reflected lobe mirrored through the surface, as KHR_materials_transmission
// has it.
static void add_thin_transmission(const struct view *view, const float i[3], struct value *to)
{
    float mirrored[3] = {i[0], i[1], -i[2]};
    float h[3] = {view->o[0] + mirrored[0], view->o[1] + mirrored[1], view->o[2] + mirrored[2]};
    if (!bd_vec3f_normalize(h)) return;
    float o_h = bd_vec3f_dot(view->o, h);
    if (o_h <= 0) return;
    struct facet facet = facet_at(view, o_h);
    float d = bd_ggx_distribution(h, view->alpha);
    float f = facet.through * d * bd_ggx_visibility(mirrored[2], view->cos_o, view->alpha);
    for (int k = 0; k < 3; k++) to->f_cos[k] += view->surface->base_color[k] * f * mirrored[2];
    to->density += view->micro_probability * (1 - facet.q) *
                   bd_ggx_visible_density(view->o, view->cos_o, h, d, view->alpha) / (4 * o_h);
}

// Refractive indices on the sides of `wo` and of the transmitted direction.
static void indices(const struct bd_surface *s, float *eta_o, float *eta_i)
{
    *eta_o = s->entering ? 1 : s->ior;
    *eta_i = s->entering ? s->ior : 1;
}

// Walter et al. 2007, equations 16, 17 and 21.
static void add_solid_transmission(const struct view *view, const float i[3], struct value *to)
{
    float eta_o, eta_i, h[3];
    indices(view->surface, &eta_o, &eta_i);
    for (int k = 0; k < 3; k++) h[k] = view->o[k] * eta_o + i[k] * eta_i;
    if (!bd_vec3f_normalize(h)) return;
    if (h[2] < 0) bd_vec3f_scale(h, h, -1);
    float o_h = bd_vec3f_dot(view->o, h), i_h = bd_vec3f_dot(i, h);
    if (o_h <= 0 || i_h >= 0) return;
    struct facet facet = facet_at(view, o_h);
    float d = bd_ggx_distribution(h, view->alpha);
    float across = eta_o * o_h + eta_i * i_h;
    float spread = -i_h / (across * across);
    float visible = bd_ggx_visible_density(view->o, view->cos_o, h, d, view->alpha);
    float masking = bd_ggx_masking(-i[2], view->alpha);
    float f = facet.through * eta_o * eta_o * spread * visible * masking;
    for (int k = 0; k < 3; k++) to->f_cos[k] += view->surface->base_color[k] * f;
    to->density += view->micro_probability * (1 - facet.q) * eta_i * eta_i * spread * visible;
}

// --- evaluation -------------------------------------------------------------------------------

static void evaluate(const struct view *view, const float i[3], struct value *to)
{
    if (i[2] > 0) {
        add_reflection(view, i, to);
        to->density += (1 - view->micro_probability) * i[2] / BD_PI_F;
    } else if (i[2] < 0 && view->transmissive > 0 && !view->delta_transmission) {
        if (view->surface->thin)
            add_thin_transmission(view, i, to);
        else
            add_solid_transmission(view, i, to);
    }
}

static void evaluate_lambert(const struct bd_surface *s, const float wi[3], float out[3],
                             float *density)
{
    float cosine = bd_vec3f_dot(s->normal, wi);
    bool above = cosine > 0 && bd_vec3f_dot(s->normal_geometric, wi) > 0;
    *density = above ? cosine / BD_PI_F : 0;
    bd_vec3f_scale(out, s->base_color, *density);
}

// Light stays on the side where the geometry says that it is (hazard 61).
static bool sides_agree(const struct view *view, const float i[3], const float wi[3])
{
    float geometric = bd_vec3f_dot(view->surface->normal_geometric, wi);
    return i[2] > 0 ? geometric > 0 : i[2] < 0 && geometric < 0;
}

static struct value value_of(const struct view *view, const float i[3], const float wi[3])
{
    struct value value = {{0, 0, 0}, 0};
    if (sides_agree(view, i, wi)) evaluate(view, i, &value);
    if (!isfinite(value.density) || !isfinite(bd_vec3f_mean(value.f_cos)))
        return (struct value){{0, 0, 0}, 0};
    return value;
}

// Most light that is sought lies behind the surface: told apart before anything else.
static bool is_reached(const struct bd_surface *s, const float wi[3])
{
    return s->transmission > 0 ||
           (bd_vec3f_dot(s->normal_geometric, wi) > 0 &&
            (bd_vec3f_dot(s->normal, wi) > 0 || bd_ggx_alpha(s->roughness) == 0));
}

void bd_bsdf_eval(const struct bd_surface *surface, const float wo[3], const float wi[3],
                  float out[3], float *density)
{
    float unused;
    if (surface->lambert) {
        evaluate_lambert(surface, wi, out, density ? density : &unused);
        return;
    }
    if (!is_reached(surface, wi)) {
        bd_vec3f_set(out, 0, 0, 0);
        if (density) *density = 0;
        return;
    }
    struct view view;
    view_begin(surface, wo, density != NULL, &view);
    float i[3] = {bd_vec3f_dot(wi, view.x), bd_vec3f_dot(wi, view.y), bd_vec3f_dot(wi, view.z)};
    struct value value = value_of(&view, i, wi);
    bd_vec3f_copy(out, value.f_cos);
    if (density) *density = value.density;
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
    out->density = bd_vec3f_dot(s->normal, out->wi) / BD_PI_F;
    out->delta = out->transmitted = false;
    return out->density > 0 && bd_vec3f_dot(s->normal_geometric, out->wi) > 0;
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

static bool transmit(const struct view *view, const float h[3], float out[3])
{
    float o_h = bd_vec3f_dot(view->o, h);
    if (!view->surface->thin) {
        float eta_o, eta_i;
        indices(view->surface, &eta_o, &eta_i);
        return refract(view->o, h, eta_o, eta_i, out);
    }
    for (int k = 0; k < 3; k++) out[k] = 2 * o_h * h[k] - view->o[k];
    out[2] = -out[2];
    return true;
}

// Radiance is compressed by the square of the indices' ratio as it passes (header).
static float radiance_scale(const struct bd_surface *s)
{
    if (s->thin) return 1;
    return s->entering ? 1 / (s->ior * s->ior) : s->ior * s->ior;
}

static bool finish_delta(const struct view *view, const struct facet *facet, bool through,
                         struct bd_bsdf_sample *out)
{
    float chance = view->micro_probability * (through ? 1 - facet->q : facet->q);
    if (through)
        bd_vec3f_scale(out->weight, view->surface->base_color,
                       facet->through * radiance_scale(view->surface) / chance);
    else
        bd_vec3f_scale(out->weight, facet->reflected, 1 / chance);
    out->density = 0;
    out->delta = true;
    return true;
}

static bool finish_smooth(const struct view *view, const float i[3], struct bd_bsdf_sample *out)
{
    struct value value = value_of(view, i, out->wi);
    if (!(value.density > 0)) return false;
    bd_vec3f_scale(out->weight, value.f_cos, 1 / value.density);
    out->density = value.density;
    out->delta = false;
    return isfinite(bd_vec3f_mean(out->weight));
}

// `choice`: uniform in [0, 1), what is left of the third number.
static bool sample_micro(const struct view *view, const float u[3], float choice,
                         struct bd_bsdf_sample *out)
{
    float h[3] = {0, 0, 1}, i[3];
    bool mirror = view->delta_reflection;
    if (!mirror) bd_ggx_sample_visible(view->o, view->cos_o, view->alpha, u, h);
    float o_h = bd_vec3f_dot(view->o, h);
    if (o_h <= 0) return false;
    struct facet facet = facet_at(view, o_h);
    bool through = choice >= facet.q;
    if (through && view->delta_transmission && !mirror) {
        // Refraction too weak to spread: all facets let it pass as the surface itself would, with
        // the transmittance of the facet that was met.
        bd_vec3f_set(h, 0, 0, 1);
        mirror = true;
    }
    if (through && !transmit(view, h, i)) return false;
    if (!through)
        for (int k = 0; k < 3; k++) i[k] = 2 * o_h * h[k] - view->o[k];
    out->transmitted = through;
    to_world(view, i, out->wi);
    if ((i[2] > 0) == through || !sides_agree(view, i, out->wi)) return false;
    return mirror ? finish_delta(view, &facet, through, out) : finish_smooth(view, i, out);
}

static bool sample_diffuse(const struct view *view, const float u[3], struct bd_bsdf_sample *out)
{
    float i[3];
    cosine_direction(u, i);
    to_world(view, i, out->wi);
    out->transmitted = false;
    return i[2] > 0 && finish_smooth(view, i, out);
}

bool bd_bsdf_sample(const struct bd_surface *surface, const float wo[3], const float u[3],
                    struct bd_bsdf_sample *out)
{
    if (surface->lambert) return sample_lambert(surface, u, out);
    struct view view;
    view_begin(surface, wo, true, &view);
    float p = view.micro_probability;
    if (u[2] < p) return sample_micro(&view, u, u[2] / p, out);
    return sample_diffuse(&view, u, out);
}

bool bd_bsdf_is_delta(const struct bd_surface *surface)
{
    if (surface->lambert || bd_ggx_alpha(surface->roughness) > 0) return false;
    return (1 - surface->metallic) * (1 - surface->transmission) == 0;
}
