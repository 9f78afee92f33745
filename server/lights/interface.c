#include "lights/interface.h"

#include <math.h>

#include "lights/directions.h"
#include "lights/facets.h"
#include "lights/shading_normal.h"
#include "lights/surface.h"

// Nothing comes through a unit of it, and of no way at all everything does.
#define EXTINCTION_MOST 1e30

// --- what is met --------------------------------------------------------------------------------

// Per metre, then per render unit.
static float extinction_of(const struct bd_material *m, const struct bd_render_space *space, int c)
{
    const double distance_m = m->attenuation_distance_m;
    if (!(m->thickness_m > 0) || !(distance_m > 0) || !isfinite(distance_m)) return 0;
    const double passed = fmax(m->attenuation_color[c], 1e-6);
    return (float)fmin(fmax(-log(passed), 0) / (distance_m * space->render_per_m), EXTINCTION_MOST);
}

f3 bd_interface_extinction(const struct bd_surface_hits *hits, int32_t material)
{
    const struct bd_material *m = &hits->scene->materials[material];
    return f3_of(extinction_of(m, &hits->space, 0), extinction_of(m, &hits->space, 1),
                 extinction_of(m, &hits->space, 2));
}

static bool fill(const struct bd_surface_hits *hits, const struct bd_surface_hit *hit,
                 const struct bd_triangle_place *place, float u, float v, f3 direction,
                 struct bd_interface *out)
{
    const struct bd_material *m = &hits->scene->materials[hit->primitive->material];
    const uint32_t *index = hit->primitive->index + 3 * (size_t)hit->of_primitive;
    const f3 data =
        bd_map_data_at(hits->scene, &m->metallic_roughness_map, hit->primitive, index, u, v).rgb;
    const float share =
        bd_share_of_interface(hits->scene, hit->primitive, index, u, v, data, hits->roughest);
    const float roughness = m->roughness * data.y;
    const bool from_behind = f3_dot(place->normal, direction) > 0, mirrors = m->transmission == 0;
    if (!(share > 0) || (mirrors && from_behind && !m->double_sided)) return false;
    const f3 geometric = f3_scale(place->normal, from_behind ? -1 : 1);
    *out = (struct bd_interface){
        .position = bd_triangle_place_at(place, u, v),
        .normal = bd_shading_normal(hit, index, u, v, geometric),
        .normal_geometric = geometric,
        .tint = bd_base_color_at(hits->scene, hit->primitive, index, u, v).rgb,
        .extinction = bd_interface_extinction(hits, hit->primitive->material),
        .share = share,
        .alpha = roughness > 0 ? ggx_alpha(roughness) : 0,
        .ior = m->ior,
        .thin = mirrors || !(m->thickness_m > 0),
        .entering = !from_behind,
        .mirrors = mirrors,
        .triangle = out->triangle,
    };
    return true;
}

// Of a triangle of glass or a mirror; false of any other, and of one without an area.
static bool find(const struct bd_surface_hits *hits, uint32_t triangle, struct bd_surface_hit *hit,
                 struct bd_triangle_place *place)
{
    *hit = bd_surface_hit_of(hits, triangle);
    const struct bd_material *m = &hits->scene->materials[hit->primitive->material];
    return bd_material_goes_on(m, hits->roughest) &&
           bd_triangle_place_of(&hits->space, hit->run, hit->instance, hit->primitive,
                                hit->of_primitive, place);
}

bool bd_interface_at(const struct bd_surface_hits *hits, uint32_t triangle, float u, float v,
                     f3 direction, struct bd_interface *out)
{
    struct bd_surface_hit hit;
    struct bd_triangle_place place;
    out->triangle = triangle;
    return find(hits, triangle, &hit, &place) && fill(hits, &hit, &place, u, v, direction, out);
}

// Barycentrics of the second and third corner, of a point in the triangle's plane.
static void barycentrics(const struct bd_triangle_place *place, f3 position, float uv[2])
{
    const f3 a = f3_sub(place->corner[1], place->corner[0]);
    const f3 b = f3_sub(place->corner[2], place->corner[0]);
    const f3 p = f3_sub(position, place->corner[0]), across = f3_cross(a, b);
    const float area2 = f3_dot(across, across);
    uv[0] = f_min(f_max(f3_dot(f3_cross(p, b), across) / area2, 0), 1);
    uv[1] = f_min(f_max(f3_dot(f3_cross(a, p), across) / area2, 0), 1 - uv[0]);
}

bool bd_interface_seen_at(const struct bd_surface_hits *hits, uint32_t triangle, f3 position,
                          f3 to_viewer, struct bd_interface *out)
{
    struct bd_surface_hit hit;
    struct bd_triangle_place place;
    float uv[2];
    if (!find(hits, triangle, &hit, &place)) return false;
    barycentrics(&place, position, uv);
    out->triangle = triangle;
    return fill(hits, &hit, &place, uv[0], uv[1], f3_scale(to_viewer, -1), out);
}

// --- how it goes on -----------------------------------------------------------------------------

// Of unpolarised light; `eta`: the index beyond by that before. An index that is none reflects all.
static float fresnel(float cosine, float eta)
{
    const float c = f_min(f_max(cosine, 0), 1);
    const float sin2 = (1 - c * c) / (eta * eta);
    if (!(eta > 0) || !isfinite(eta) || sin2 >= 1) return 1;
    const float beyond = f_sqrt(1 - sin2);
    const float parallel = (eta * c - beyond) / (eta * c + beyond);
    const float across = (c - eta * beyond) / (c + eta * beyond);
    return 0.5f * (parallel * parallel + across * across);
}

static float eta_of(const struct bd_interface *at)
{
    return at->entering ? at->ior : 1 / at->ior;
}

// A thin wall's is glTF's own; within a solid that has no total reflection.
static float reflectance(const struct bd_interface *at, float cosine)
{
    if (!at->thin) return fresnel(cosine, eta_of(at));
    const float f0 = bd_f0_of_ior(at->ior);
    return f0 + (1 - f0) * f_fifth(f_min(f_max(1 - cosine, 0), 1));
}

// Smith's G1.
static float masking(float cosine, float alpha)
{
    const float c = f_max(cosine, 1e-12f);
    return 2 * c / (c + smith_root(c, alpha));
}

// Of both directions together, by that of the viewer's, with which facets were chosen: correlated
// where light is reflected, each for itself where it passes.
static float seen_of_light(const struct bd_interface *at, float to_viewer, float to_light,
                           bool passes)
{
    if (at->alpha == 0) return 1;
    const float first = masking(to_light, at->alpha);
    if (passes && !at->thin) return first;
    return bd_facets_leave(to_viewer, to_light, at->alpha);
}

static bool refract(f3 viewer, f3 h, float eta, f3 *out)
{
    const float c = f3_dot(viewer, h), sin2 = f_max(1 - c * c, 0) / (eta * eta);
    if (!(sin2 < 1)) return false;
    *out = f3_unit(f3_add(f3_scale(viewer, -1 / eta), f3_scale(h, c / eta - f_sqrt(1 - sin2))));
    return true;
}

static bool pass(const struct bd_interface *at, f3 n, f3 viewer, f3 h, f3 *out)
{
    if (!at->thin) return refract(viewer, h, eta_of(at), out);
    if (at->alpha == 0) {
        *out = f3_scale(viewer, -1);
        return true;
    }
    const f3 back = bd_mirrored(viewer, h); // the reflected lobe, turned to the other side
    *out = f3_sub(back, f3_scale(n, 2 * f3_dot(back, n)));
    return true;
}

// Radiance that leaves a solid is less by the square of its index: what it filled there fills more
// directions.
static float spread_of(const struct bd_interface *at)
{
    if (at->thin) return 1;
    return at->entering ? 1 / (at->ior * at->ior) : at->ior * at->ior;
}

static bool mirror(const struct bd_interface *at, f3 n, f3 viewer, f3 h, struct bd_onward *out)
{
    const float grazing = f_fifth(f_min(f_max(1 - f3_dot(viewer, h), 0), 1));
    out->passes = false;
    out->spread = 1;
    out->direction = bd_mirrored(viewer, h);
    const float leaves = f3_dot(out->direction, n);
    if (!(leaves > 0) || !(f3_dot(out->direction, at->normal_geometric) > 0)) return false;
    const f3 color = f3_add(f3_scale(at->tint, 1 - grazing), f3_of(grazing, grazing, grazing));
    out->weight = f3_scale(color, seen_of_light(at, f3_dot(viewer, n), leaves, false));
    return true;
}

bool bd_interface_go_on(const struct bd_interface *at, f3 direction, enum bd_onward_choice choice,
                        const float number[3], struct bd_onward *out)
{
    const f3 viewer = f3_scale(direction, -1);
    const f3 n = f3_dot(at->normal, viewer) > 0 ? at->normal : at->normal_geometric;
    const f3 h = at->alpha > 0 ? bd_visible_normal(n, viewer, at->alpha, number) : n;
    const float cosine = f3_dot(viewer, h);
    if (!(cosine > 0)) return false;
    if (at->mirrors) return choice == BD_ONWARD_EITHER && mirror(at, n, viewer, h, out);
    const float back = reflectance(at, cosine);
    const float through = (1 - back) * (at->tint.x + at->tint.y + at->tint.z) / 3;
    if (choice == BD_ONWARD_PASSES && !(through > 0)) return false;
    const float chance = choice == BD_ONWARD_PASSES ? 0 : back / f_max(back + through, 1e-20f);
    out->passes = number[2] >= chance;
    if (!out->passes)
        out->direction = bd_mirrored(viewer, h);
    else if (!pass(at, n, viewer, h, &out->direction))
        return false;
    const float side = f3_dot(out->direction, n);
    const bool is_behind = side <= 0;
    const bool is_behind_wall = f3_dot(out->direction, at->normal_geometric) <= 0;
    if (is_behind != out->passes || is_behind_wall != out->passes) return false;
    const float seen = seen_of_light(at, f3_dot(viewer, n), f_abs(side), out->passes);
    out->spread = out->passes ? spread_of(at) : 1;
    out->weight = out->passes
                      ? f3_scale(at->tint, (1 - back) * seen / (1 - chance))
                      : f3_of(back * seen / chance, back * seen / chance, back * seen / chance);
    return true;
}

// --- within --------------------------------------------------------------------------------------

static float passed_of(float extinction, float distance)
{
    return extinction > 0 ? expf(-extinction * distance) : 1;
}

f3 bd_interface_absorbed(f3 light, f3 extinction, float distance)
{
    return f3_mul(light, f3_of(passed_of(extinction.x, distance), passed_of(extinction.y, distance),
                               passed_of(extinction.z, distance)));
}

// --- straight on --------------------------------------------------------------------------------

bool bd_interface_is_pane(const struct bd_interface *at)
{
    return at->thin && at->alpha == 0 && !at->mirrors;
}

f3 bd_interface_straight(const struct bd_interface *at, enum bd_straight straight, f3 direction)
{
    const float ahead = -f3_dot(at->normal, direction);
    const float cosine = ahead > 0 ? ahead : -f3_dot(at->normal_geometric, direction);
    if (at->mirrors || (straight == BD_STRAIGHT_PANES && !bd_interface_is_pane(at)))
        return f3_of(0, 0, 0);
    return f3_scale(at->tint, at->share * (1 - reflectance(at, cosine)));
}
