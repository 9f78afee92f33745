#include "pass/punctual_lanes.h"

#include "kernel/brdf.h"
#include "kernel/light.h"
#include "pass/f3_arrays.h"

// --- of a block ---------------------------------------------------------------------------------

void bd_punctual_lanes_put(struct bd_punctual_lanes *l, uint32_t i,
                           const struct bd_light_uniform *punctual)
{
    const bool parallel = punctual->kind == BD_LIGHT_KIND_DIRECTIONAL;
    l->x[i] = punctual->position.x;
    l->y[i] = punctual->position.y;
    l->z[i] = punctual->position.z;
    l->ahead_x[i] = punctual->direction.x;
    l->ahead_y[i] = punctual->direction.y;
    l->ahead_z[i] = punctual->direction.z;
    l->cos_outer[i] = punctual->cos_outer;
    l->per_cosine[i] = punctual->per_cosine;
    l->inverse_range[i] = parallel ? 0 : punctual->inverse_range;
    l->parallel[i] = parallel;
    l->brightest[i] =
        f_max(punctual->intensity.x, f_max(punctual->intensity.y, punctual->intensity.z));
}

// Parallel light comes as from a unit away.
void bd_punctual_lanes_weigh(const struct bd_punctual_lanes *restrict l, uint32_t count,
                             const struct bd_area_receiver *at, float *restrict weight)
{
    const f3 position = at->position, normal = at->normal, n_geometric = at->normal_geometric;
    for (size_t i = 0; i < count; i++) {
        const f3 ahead = f3_of(l->ahead_x[i], l->ahead_y[i], l->ahead_z[i]);
        const f3 from_place = f3_sub(f3_of(l->x[i], l->y[i], l->z[i]), position);
        const f3 span = f3_select(l->parallel[i] != 0, f3_scale(ahead, -1), from_place);
        const float part =
            irradiance_at(span, ahead, l->cos_outer[i], l->per_cosine[i], l->inverse_range[i]);
        const float across = f3_dot(normal, span);
        const float cosine = across / f_sqrt(f_max(f3_dot(span, span), 1e-30f));
        const bool is_above = b_and(across > 0, f3_dot(n_geometric, span) > 0);
        weight[i] = f_select(is_above, l->brightest[i] * part * cosine, 0);
    }
}

// --- pairs --------------------------------------------------------------------------------------

void bd_punctual_pairs_put(struct bd_punctual_pairs *p, uint32_t i,
                           const struct bd_area_receiver *at,
                           const struct bd_light_uniform *punctual)
{
    const bool parallel = punctual->kind == BD_LIGHT_KIND_DIRECTIONAL;
    const f3 ahead = f3_of(punctual->direction.x, punctual->direction.y, punctual->direction.z);
    const f3 place = f3_of(punctual->position.x, punctual->position.y, punctual->position.z);
    f3_put_at(&p->span, i, parallel ? f3_scale(ahead, -1) : f3_sub(place, at->position));
    f3_put_at(&p->ahead, i, ahead);
    f3_put_at(&p->intensity, i,
              f3_of(punctual->intensity.x, punctual->intensity.y, punctual->intensity.z));
    f3_put_at(&p->normal, i, at->normal);
    f3_put_at(&p->viewer, i, at->viewer);
    f3_put_at(&p->base_color, i, at->base_color);
    p->cos_outer[i] = punctual->cos_outer;
    p->per_cosine[i] = punctual->per_cosine;
    p->inverse_range[i] = parallel ? 0 : punctual->inverse_range;
    p->metallic[i] = at->metallic;
    p->roughness[i] = at->roughness;
    p->f0_dielectric[i] = at->f0_dielectric;
}

static inline __attribute__((always_inline)) void light(struct bd_punctual_pairs *restrict p,
                                                        struct bd_lanes3 *restrict irradiance,
                                                        struct bd_lanes3 *restrict beyond,
                                                        bool lambert)
{
    for (size_t i = 0; i < BD_LANES; i++) {
        const f3 span = f3_at(&p->span, i), normal = f3_at(&p->normal, i),
                 color = f3_at(&p->base_color, i);
        const f3 l = f3_unit(span);
        const float part = irradiance_at(span, f3_at(&p->ahead, i), p->cos_outer[i],
                                         p->per_cosine[i], p->inverse_range[i]);
        const f3 arrived = f3_scale(f3_at(&p->intensity, i), part * f3_dot(normal, l));
        const f3 viewer = f3_at(&p->viewer, i);
        const f3 f = lambert ? lambert_brdf(color)
                             : gltf_brdf(color, p->metallic[i], p->roughness[i],
                                         p->f0_dielectric[i], normal, l, viewer);
        const float albedo = lambert ? 1 : 1 - p->metallic[i];
        const f3 more = f3_mul(f3_sub(f, f3_scale(color, albedo * (1 / F_PI))), arrived);
        irradiance->x[i] = arrived.x;
        irradiance->y[i] = arrived.y;
        irradiance->z[i] = arrived.z;
        beyond->x[i] = more.x;
        beyond->y[i] = more.y;
        beyond->z[i] = more.z;
    }
}

void bd_punctual_pairs_light(struct bd_punctual_pairs *pairs, bool lambert)
{
    struct bd_lanes3 irradiance, beyond;
    if (lambert)
        light(pairs, &irradiance, &beyond, true);
    else
        light(pairs, &irradiance, &beyond, false);
    pairs->irradiance = irradiance;
    pairs->beyond = beyond;
}
