#include "lights/point_lobes.h"

#include <stdlib.h>

#include "kernel/all_channels.h"
#include "kernel/brdf.h"
#include "kernel/projected_point.h"
#include "lights/reflection.h"
#include "lights/surface.h"

// What a lobe returns of light from everywhere, white, for which it is worth its price: that of
// plastic returns .03 to .08. Sent evenly, that was 8 % of Sibenik's first reflection too much.
#define LOBE_LEAST 0.02f

static f3 loaded(const float v[3])
{
    return f3_of(v[0], v[1], v[2]);
}

static void store(float to[3], f3 v)
{
    to[0] = v.x;
    to[1] = v.y;
    to[2] = v.z;
}

// --- which sides --------------------------------------------------------------------------------

static float returned_by_lobe(f3 base_color, float metallic, float roughness, float f0_dielectric)
{
    const f3 all = sent_by_lobes(base_color, f3_of(0, 0, 0), metallic, f0_dielectric,
                                 lobe_sent_white(roughness), lobe_sent_grazing(roughness));
    return all_channels(all) / 3;
}

// By a map some of it may be smooth.
static bool may_have_lobe(const struct bd_material *m)
{
    const bool has_map = m->metallic_roughness_map.texture != BD_NONE;
    const float roughness = has_map ? 0 : m->roughness;
    return returned_by_lobe(f3_of(1, 1, 1), m->metallic, roughness, bd_f0_of_ior(m->ior)) >=
           LOBE_LEAST;
}

enum bd_err bd_point_lobes_init(struct bd_point_lobes *lobes, const struct bd_surface_hits *hits,
                                const struct bd_surface_point *places, const uint32_t *sides,
                                uint32_t place_count, uint32_t side_count,
                                struct bd_err_detail *detail)
{
    *lobes = (struct bd_point_lobes){.of_side = malloc((side_count + 1) * sizeof(uint32_t))};
    if (!lobes->of_side) return bd_err_set(detail, BD_ERR_NO_MEMORY, "points", "no memory");
    for (uint32_t i = 0; i < side_count; i++) lobes->of_side[i] = BD_NO_LOBE;
    for (uint32_t i = 0; i < place_count; i++) {
        const struct bd_surface_hit hit = bd_surface_hit_of(hits, places[i].triangle);
        if (may_have_lobe(&hits->scene->materials[hit.primitive->material]))
            lobes->of_side[sides[i]] = lobes->count++;
    }
    lobes->sending = calloc(lobes->count + 1, sizeof *lobes->sending);
    if (!lobes->sending) {
        bd_point_lobes_finish(lobes);
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "points", "no memory for their lobes");
    }
    if (lobes->count == 0) bd_point_lobes_finish(lobes);
    return BD_ERR_OK;
}

void bd_point_lobes_finish(struct bd_point_lobes *lobes)
{
    free(lobes->of_side);
    free(lobes->sending);
    *lobes = (struct bd_point_lobes){0};
}

// --- what they get ------------------------------------------------------------------------------

// Of a place whose triangle is known.
static bool reflecting_at(const struct bd_surface_hits *hits, const struct bd_surface_point *place,
                          struct bd_reflecting *out)
{
    struct bd_hit_triangle triangle;
    if (!bd_surface_hit_triangle(hits, place->triangle, &triangle)) return false;
    const f3 a = triangle.corner[0], at = f3_sub(place->position, a);
    const f3 ab = f3_sub(triangle.corner[1], a), ac = f3_sub(triangle.corner[2], a);
    const f3 across = f3_cross(ab, ac);
    const float per = 1 / f3_dot(across, across);
    const float u = f3_dot(f3_cross(at, ac), across) * per;
    const float v = f3_dot(f3_cross(ab, at), across) * per;
    *out = bd_reflecting_at(hits, place, f_min(f_max(u, 0), 1), f_min(f_max(v, 0), 1));
    return true;
}

static uint32_t strongest(const struct bd_first_way *ways, uint32_t count, uint32_t taken)
{
    uint32_t best = count;
    float most = 0;
    for (uint32_t i = 0; i < count; i++) {
        const float strength = strongest_channel(ways[i].irradiance);
        if (taken >> i & 1 || !(strength > most)) continue;
        most = strength;
        best = i;
    }
    return best;
}

static f3 sum_of(const struct bd_first_way *ways, uint32_t count, uint32_t taken)
{
    f3 sum = f3_of(0, 0, 0);
    for (uint32_t i = 0; i < count; i++)
        if (!(taken >> i & 1)) sum = f3_add(sum, ways[i].irradiance);
    return sum;
}

// Irradiance is the triangle's, and what it sends is as much as stays beside glass and mirrors.
static void keep_ways(struct bd_sending_point *to, const struct bd_reflecting *s, float stays,
                      const struct bd_first_way *ways, uint32_t count, uint32_t *taken)
{
    while (to->count < BD_POINT_LOBES) {
        const uint32_t i = strongest(ways, count, *taken);
        if (i == count) return;
        struct bd_point_lobe *lobe = &to->lobes[to->count++];
        *taken |= 1u << i;
        store(lobe->irradiance,
              f3_scale(ways[i].irradiance,
                       stays * bd_bent(s->normal, s->normal_geometric, ways[i].way)));
        lobe->way = bits_of_normal(ways[i].way);
    }
}

f3 bd_point_lobes_keep(struct bd_point_lobes *lobes, const struct bd_surface_hits *hits,
                       const struct bd_surface_point *place, uint32_t side,
                       const struct bd_first_way *ways, uint32_t count)
{
    uint32_t taken = 0;
    struct bd_reflecting s;
    if (!lobes->of_side || lobes->of_side[side] == BD_NO_LOBE || !reflecting_at(hits, place, &s))
        return sum_of(ways, count, 0);
    if (returned_by_lobe(s.base_color, s.metallic, s.roughness, s.f0_dielectric) < LOBE_LEAST)
        return sum_of(ways, count, 0);
    struct bd_sending_point *to = &lobes->sending[lobes->of_side[side]];
    const f3 sent =
        sent_from_everywhere(s.base_color, s.metallic, s.roughness, s.f0_dielectric);
    const float stays = f_min(all_channels(place->diffuse) / f_max(all_channels(sent), 1e-6f), 1);
    keep_ways(to, &s, stays, ways, count, &taken);
    store(to->base_color, s.base_color);
    to->metallic = s.metallic;
    to->roughness = patch_roughness(s.roughness);
    to->f0_dielectric = s.f0_dielectric;
    to->normal = bits_of_normal(s.normal);
    return sum_of(ways, count, taken);
}

// --- what they send -----------------------------------------------------------------------------

static const struct bd_sending_point *sending_of(const struct bd_point_lobes *lobes, uint32_t side)
{
    if (!lobes->of_side || lobes->of_side[side] == BD_NO_LOBE) return NULL;
    return &lobes->sending[lobes->of_side[side]];
}

f3 bd_point_lobes_send(const struct bd_point_lobes *lobes, uint32_t side, f3 to_viewer)
{
    const struct bd_sending_point *s = sending_of(lobes, side);
    f3 sum = f3_of(0, 0, 0);
    for (uint32_t i = 0; s && i < s->count; i++) {
        const f3 brdf = gltf_brdf(loaded(s->base_color), s->metallic, s->roughness,
                                  s->f0_dielectric, normal_of_bits(s->normal),
                                  normal_of_bits(s->lobes[i].way), to_viewer);
        sum = f3_add(sum, f3_mul(loaded(s->lobes[i].irradiance), brdf));
    }
    return sum;
}

f3 bd_point_lobes_get(const struct bd_point_lobes *lobes, uint32_t side)
{
    const struct bd_sending_point *s = sending_of(lobes, side);
    f3 sum = f3_of(0, 0, 0);
    for (uint32_t i = 0; s && i < s->count; i++)
        sum = f3_add(sum, loaded(s->lobes[i].irradiance));
    return sum;
}

uint64_t bd_point_lobes_bytes(const struct bd_point_lobes *lobes, uint32_t side_count)
{
    if (!lobes->of_side) return 0;
    return side_count * sizeof *lobes->of_side + lobes->count * sizeof *lobes->sending;
}
