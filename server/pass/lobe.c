#include "pass/lobe.h"

#include <math.h>

#include "kernel/brdf.h"
#include "lights/directions.h"
#include "pass/f3_arrays.h"

bool bd_lobe_receiver_at(const struct bd_receiver_part *part, uint32_t group, uint32_t lane,
                         struct bd_area_receiver *out)
{
    const struct bd_receivers *r = &part->receivers[group];
    const struct bd_ray_starts *start = &part->starts[group];
    const struct bd_glossy_receivers *surface = &part->surfaces[group];
    const struct bd_tile *tile = &part->slice.tile;
    const uint32_t index = group * BD_LANES + lane;
    if (index >= part->count || r->lit[lane] == 0) return false;
    *out = (struct bd_area_receiver){
        .position = f3_at(&start->position, lane),
        .normal = f3_at(&r->normal, lane),
        .normal_geometric = f3_at(&start->normal_geometric, lane),
        .viewer = f3_at(&surface->viewer, lane),
        .base_color = f3_at(&surface->base_color, lane),
        .metallic = surface->metallic[lane],
        .roughness = surface->roughness[lane],
        .f0_dielectric = surface->f0_dielectric[lane],
        .has_lobe = surface->has_lobe[lane] != 0,
        .triangle = start->triangle[lane],
        .x_px = tile->x + index % tile->width,
        .y_px = tile->y + index / tile->width,
    };
    out->place = bd_sequence_place(out->x_px, out->y_px, 1);
    return true;
}

struct bd_lobe bd_lobe_of(const struct bd_area_receiver *at, bool lambert)
{
    const float cosine = view_cosine(at->normal, at->viewer), alpha = ggx_alpha(at->roughness);
    return (struct bd_lobe){
        .at = at,
        .lambert = lambert,
        .is_there = at->has_lobe && !lambert && f3_dot(at->normal, at->viewer) > 0,
        .alpha = alpha,
        .view_cosine = cosine,
        .view_root = smith_root(cosine, alpha),
    };
}

static f3 brdf_towards(const struct bd_lobe *lobe, f3 l)
{
    const struct bd_area_receiver *at = lobe->at;
    if (lobe->lambert) return f3_scale(at->base_color, 1 / F_PI);
    return brdf_of_view(at->base_color, at->metallic, at->roughness, at->f0_dielectric, at->normal,
                        l, at->viewer, lobe->view_cosine, lobe->view_root);
}

static f3 diffuse_albedo(const struct bd_lobe *lobe)
{
    return f3_scale(lobe->at->base_color, lobe->lambert ? 1 : 1 - lobe->at->metallic);
}

struct bd_area_light_found bd_lobe_received(const struct bd_lobe *lobe, f3 l)
{
    const float cosine = f3_dot(lobe->at->normal, l);
    const f3 beyond = f3_sub(brdf_towards(lobe, l), f3_scale(diffuse_albedo(lobe), 1 / F_PI));
    return (struct bd_area_light_found){f3_of(cosine, cosine, cosine), f3_scale(beyond, cosine)};
}

float bd_lobe_specular(const struct bd_lobe *lobe, f3 l)
{
    const struct bd_area_receiver *at = lobe->at;
    const f3 black = f3_of(0, 0, 0);
    return f3_dot(at->normal, l) * brdf_of_view(black, 0, at->roughness, at->f0_dielectric,
                                                at->normal, l, at->viewer, lobe->view_cosine,
                                                lobe->view_root)
                                       .x;
}

bool bd_lobe_is_above(const struct bd_lobe *lobe, f3 l)
{
    return f3_dot(lobe->at->normal, l) > 0 && f3_dot(lobe->at->normal_geometric, l) > 0;
}

float bd_lobe_pdf(const struct bd_lobe *lobe, f3 l)
{
    const f3 sum = f3_add(l, lobe->at->viewer), n = lobe->at->normal;
    const float length = f3_length(sum);
    if (!(length > 0)) return 0;
    const f3 h = f3_scale(sum, 1 / length), across = f3_cross(n, h);
    const float n_h = f_max(f3_dot(n, h), 0), a2 = lobe->alpha * lobe->alpha;
    const float d = f3_dot(across, across) + n_h * n_h * a2;
    return n_h > 0 ? a2 / (F_PI * d * d) / (2 * (lobe->view_cosine + lobe->view_root)) : 0;
}

f3 bd_lobe_choose(const struct bd_lobe *lobe, const float number[2])
{
    const f3 v = lobe->at->viewer;
    const f3 h = bd_visible_normal(lobe->at->normal, v, lobe->alpha, number);
    return f3_unit(f3_sub(f3_scale(h, 2 * f3_dot(v, h)), v));
}
