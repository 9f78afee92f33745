#include "lights/reflection.h"

#include "kernel/diffuse_limit.h"
#include "lights/directions.h"
#include "lights/facets.h"
#include "lights/shading_normal.h"
#include "lights/surface.h"

struct bd_reflecting bd_reflecting_at(const struct bd_surface_hits *hits,
                                      const struct bd_surface_point *at, float u, float v)
{
    const struct bd_surface_hit hit = bd_surface_hit_of(hits, at->triangle);
    const struct bd_material *m = &hits->scene->materials[hit.primitive->material];
    const uint32_t *index = hit.primitive->index + 3 * (size_t)hit.of_primitive;
    const f3 data =
        bd_map_data_at(hits->scene, &m->metallic_roughness_map, hit.primitive, index, u, v).rgb;
    return (struct bd_reflecting){
        .base_color = bd_base_color_at(hits->scene, hit.primitive, index, u, v).rgb,
        .normal = bd_shading_normal(&hit, index, u, v, at->normal),
        .normal_geometric = at->normal,
        .metallic = m->metallic * data.z,
        .roughness = m->roughness * data.y,
        .f0_dielectric = bd_f0_of_ior(m->ior),
    };
}

// Of facets under that angle, of all colours.
static f3 fresnel(const struct bd_reflecting *s, float cosine)
{
    const float grazing = f_fifth(f_min(f_max(1 - cosine, 0), 1));
    const float white = (1 - s->metallic) * (s->f0_dielectric + (1 - s->f0_dielectric) * grazing) +
                        s->metallic * grazing;
    return f3_add(f3_of(white, white, white), f3_scale(s->base_color, s->metallic * (1 - grazing)));
}

static float mean(f3 v)
{
    return (v.x + v.y + v.z) / 3;
}

static void reflect_evenly(const struct bd_reflecting *s, const float number[3], f3 color,
                           struct bd_reflection *out)
{
    const f3 n = s->normal_geometric;
    const struct bd_basis basis = bd_basis_of(n);
    out->direction = bd_from_basis(&basis, n, bd_cosine_direction(number));
    out->weight = color;
}

// Its Fresnel term is that of the facet between both directions, as in the BRDF.
static void reflect_diffusely(const struct bd_reflecting *s, f3 viewer, const float number[3],
                              struct bd_reflection *out)
{
    reflect_evenly(s, number, s->base_color, out);
    const f3 n = s->normal_geometric, h = f3_unit(f3_add(viewer, out->direction));
    const float grazing = f_fifth(f_min(f_max(1 - f3_dot(viewer, h), 0), 1));
    const float limit =
        diffuse_limit(f_min(f3_dot(n, viewer), f3_dot(n, out->direction)), s->roughness);
    const float passes =
        (1 - s->metallic) * (1 - (s->f0_dielectric + (1 - s->f0_dielectric) * grazing));
    out->weight = f3_scale(f3_min(s->base_color, limit), passes);
}

static bool reflect_specularly(const struct bd_reflecting *s, f3 viewer, const float number[3],
                               struct bd_reflection *out)
{
    const f3 n = f3_dot(s->normal, viewer) > 0 ? s->normal : s->normal_geometric;
    const float alpha = ggx_alpha(s->roughness);
    const f3 h = bd_visible_normal(n, viewer, alpha, number);
    out->direction = bd_mirrored(viewer, h);
    const float leaves = f3_dot(out->direction, n);
    if (!(leaves > 0) || !(f3_dot(out->direction, s->normal_geometric) > 0)) return false;
    out->weight =
        f3_scale(fresnel(s, f3_dot(viewer, h)), bd_facets_leave(f3_dot(viewer, n), leaves, alpha));
    return true;
}

bool bd_reflect(const struct bd_surface_hits *hits, const struct bd_surface_point *at, float u,
                float v, f3 direction, bool lambert, bool beside_interface, const float number[3],
                struct bd_reflection *out)
{
    struct bd_reflecting s = bd_reflecting_at(hits, at, u, v);
    if (beside_interface) s.metallic = 0;
    const f3 viewer = f3_scale(direction, -1);
    if (lambert) {
        reflect_evenly(&s, number, s.base_color, out);
        return true;
    }
    const float specular = mean(fresnel(&s, f3_dot(s.normal, viewer)));
    const float diffuse = mean(s.base_color) * (1 - s.metallic) * (1 - s.f0_dielectric);
    const float chance = specular / f_max(specular + diffuse, 1e-20f);
    const bool is_specular = number[2] < chance;
    if (!is_specular)
        reflect_diffusely(&s, viewer, number, out);
    else if (!reflect_specularly(&s, viewer, number, out))
        return false;
    out->weight = f3_scale(out->weight, 1 / (is_specular ? chance : 1 - chance));
    return true;
}
