// Direct light at a group of pixels, as shaders/pass/direct/direct.comp has it: what a light gives
// if nothing stands between, and which triangles do. What the shadow map names is looked up by
// pass/direct_look.c.

#include "pass/native/loops.h"

#include "kernel/brdf.h"
#include "kernel/light.h"
#include "kernel/octahedral.h"
#include "kernel/pixel.h"
#include "kernel/shadow.h"
#include "pass/native/lanes.h"

// --- pixels -------------------------------------------------------------------------------------

struct place {
    float x[BD_LANES], y[BD_LANES], exists[BD_LANES];
};

struct surface {
    struct bd_lanes3 relative, position, viewer, normal, normal_geometric, base_color;
    float metallic[BD_LANES], roughness[BD_LANES], f0_dielectric[BD_LANES], lit[BD_LANES];
};

static void find_pixels(const struct bd_native_pixels *p, uint32_t first, struct place *place)
{
    uint32_t x = first % p->view->size_px.x, y = p->first_row + first / p->view->size_px.x;
    LANES(i)
    {
        place->x[i] = (float)x + p->view->sample_px.x;
        place->y[i] = (float)y + p->view->sample_px.y;
        place->exists[i] = first + i < p->count;
        y += ++x == p->view->size_px.x;
        if (x == p->view->size_px.x) x = 0;
    }
}

static void find_places(const struct bd_view *restrict view, const struct place *restrict place,
                        const float *restrict depths, struct surface *restrict s)
{
    const f3 axis_x = f3_from(&view->axis_x), axis_y = f3_from(&view->axis_y);
    const f3 axis_z = f3_from(&view->axis_z), origin = f3_from(&view->position);
    const float width = (float)view->size_px.x, height = (float)view->size_px.y;
    const float half_width = view->axis_x.w, half_height = view->axis_y.w;
    const bool orthographic = view->position.w != 0.0f;
    LANES(i)
    {
        const float slope_x = ndc_to_right(place->x[i], width) * half_width;
        const float slope_y = ndc_up(place->y[i], height) * half_height, depth = depths[i];
        const float reach = f_select(orthographic, 1.0f, depth);
        const f3 at = place_in_view(axis_x, axis_y, axis_z, slope_x, slope_y, reach, depth);
        f3_put_at(&s->relative, i, at);
        f3_put_at(&s->position, i, f3_add(origin, at));
        f3_put_at(&s->viewer, i, f3_select(orthographic, axis_z, f3_unit(f3_scale(at, -1.0f))));
    }
}

static void find_normals(const float *restrict normals, struct surface *restrict s)
{
    LANES(i)
    {
        const float *n = normals + 4 * i;
        f3_put_at(&s->normal, i, unit_of_octahedral(n[0], n[1]));
        f3_put_at(&s->normal_geometric, i, unit_of_octahedral(n[2], n[3]));
    }
}

static inline float unorm(uint16_t value)
{
    return (float)value * (1.0f / 65535.0f);
}

static void find_materials(const uint16_t *restrict albedo, const uint16_t *restrict material,
                           const float *restrict exists, struct surface *restrict s)
{
    LANES(i)
    {
        const uint16_t *a = albedo + 4 * i, *m = material + 4 * i;
        f3_put_at(&s->base_color, i, f3_of(unorm(a[0]), unorm(a[1]), unorm(a[2])));
        s->metallic[i] = unorm(a[3]);
        s->roughness[i] = unorm(m[0]);
        s->f0_dielectric[i] = unorm(m[1]);
        s->lit[i] = f_select(surface_is_lit(m[2], m[3]), exists[i], 0.0f);
    }
}

// --- what a light gives -------------------------------------------------------------------------

// To the light, and irradiance there times the cosine.
struct arrival {
    struct bd_lanes3 to_light, light;
};

static inline __attribute__((always_inline)) void
aim_at(const struct surface *restrict s, const struct bd_light_uniform *restrict light,
       bool directional, struct arrival *restrict arrival, struct bd_native_aim *restrict aim)
{
    const f3 place = f3_from(&light->position), direction = f3_from(&light->direction);
    const f3 intensity = f3_from(&light->intensity), far = f3_scale(direction, -light->distance);
    const float outer = light->cos_outer, per_cosine = light->per_cosine,
                range = light->inverse_range;
    LANES(i)
    {
        const f3 position = f3_at(&s->position, i), normal = f3_at(&s->normal, i);
        const f3 n_geometric = f3_at(&s->normal_geometric, i);
        const f3 span = directional ? far : f3_sub(place, position), l = f3_unit(span);
        const float part =
            directional ? 1.0f : irradiance_at(span, direction, outer, per_cosine, range);
        const float cosine = f3_dot(normal, l), lit = s->lit[i];
        const bool is_above = b_and(cosine > 0.0f, f3_dot(n_geometric, l) > 0.0f);
        const f3 origin = shadow_origin(position, f3_at(&s->relative, i), n_geometric, l);
        f3_put_at(&arrival->to_light, i, l);
        f3_put_at(&arrival->light, i, f3_scale(f3_scale(intensity, part), cosine));
        f3_put_at(&aim->origin, i, origin);
        f3_put_at(&aim->span, i, directional ? far : f3_sub(place, origin));
        aim->is_lit[i] = b_and(b_and(is_above, part > 0.0f), lit > 0.0f);
    }
}

static inline f3 in_light_frame(const struct bd_light_uniform *light, f3 from_light)
{
    return f3_of(f3_dot(from_light, f3_from(&light->axis_x)),
                 f3_dot(from_light, f3_from(&light->axis_y)),
                 f3_dot(from_light, f3_from(&light->axis_z)));
}

static void find_faces(const struct bd_light_uniform *restrict light,
                       const struct bd_lanes3 *restrict origin, uint32_t *restrict face)
{
    const f3 place = f3_from(&light->position);
    LANES(i) face[i] = face_towards(in_light_frame(light, f3_sub(f3_at(origin, i), place)));
}

static inline __attribute__((always_inline)) void
find_texels(const struct bd_light_uniform *restrict light, const struct bd_lanes3 *restrict origin,
            const uint32_t *restrict face, bool directional, struct bd_native_texels *restrict t)
{
    const f3 place = f3_from(&light->position);
    const float half_width = light->half_width, half_height = light->half_height;
    const float side = (float)light->face_side_px;
    LANES(i)
    {
        const f3 from_light = f3_sub(f3_at(origin, i), place);
        const f3 seen = seen_from_face(in_light_frame(light, from_light), face[i]);
        const float reach = directional ? 1.0f : f_max(seen.z, 1e-20f);
        const float distance = directional ? 1.0f : f3_length(from_light);
        t->x[i] = shadow_texel_at(seen.x, half_width, reach, side);
        t->y[i] = shadow_texel_at(-seen.y, half_height, reach, side);
        t->side[i] = shadow_texel_side(half_width, half_height, side, distance);
    }
}

static inline __attribute__((always_inline)) void reflect(const struct surface *restrict s,
                                                          const struct arrival *restrict arrival,
                                                          bool lambert,
                                                          struct bd_lanes3 *restrict radiance)
{
    LANES(i)
    {
        const f3 base_color = f3_at(&s->base_color, i);
        const f3 f = lambert ? lambert_brdf(base_color)
                             : gltf_brdf(base_color, s->metallic[i], s->roughness[i],
                                         s->f0_dielectric[i], f3_at(&s->normal, i),
                                         f3_at(&arrival->to_light, i), f3_at(&s->viewer, i));
        f3_put_at(radiance, i, f3_mul(f, f3_at(&arrival->light, i)));
    }
}

static inline __attribute__((always_inline)) void aim_by(const struct surface *s,
                                                         const struct bd_light_uniform *light,
                                                         bool directional, struct arrival *arrival,
                                                         struct bd_native_aim *aim)
{
    aim_at(s, light, directional, arrival, aim);
    LANES(i) aim->face[i] = LIGHT_ONE_FACE;
    if (light->face_count > 1) find_faces(light, &aim->origin, aim->face);
    find_texels(light, &aim->origin, aim->face, directional, &aim->texel);
}

void WIDE(bd_native_aim)(const struct bd_native_pixels *pixels, uint32_t first,
                         const struct bd_light_uniform *light, bool lambert,
                         struct bd_native_aim *aim)
{
    const size_t at = first;
    struct place place;
    struct surface s;
    struct arrival arrival;
    find_pixels(pixels, first, &place);
    find_places(pixels->view, &place, pixels->depth + at, &s);
    find_normals(pixels->normals + 4 * at, &s);
    find_materials(pixels->albedo + 4 * at, pixels->material + 4 * at, place.exists, &s);
    if (light->kind == BD_LIGHT_KIND_DIRECTIONAL) // a copy of the loops for each kind
        aim_by(&s, light, true, &arrival, aim);
    else
        aim_by(&s, light, false, &arrival, aim);
    if (lambert)
        reflect(&s, &arrival, true, &aim->radiance);
    else
        reflect(&s, &arrival, false, &aim->radiance);
    aim->irradiance = arrival.light;
    LANES(i) aim->triangle[i] = pixels->triangle[at + i];
}

// --- what stands between ------------------------------------------------------------------------

void WIDE(bd_native_ask)(const struct bd_native_pairs *restrict p, uint32_t *restrict said)
{
    LANES(i)
    {
        const f3 origin = f3_at(&p->origin, i), span = f3_at(&p->span, i);
        const f3 corner = f3_at(&p->corner, i), edge1 = f3_at(&p->edge1, i);
        const f3 edge2 = f3_at(&p->edge2, i);
        const float side = p->texel_side[i];
        const bool opens = triangle_leaves_open(origin, span, corner, edge1, edge2, side);
        const bool hides = segment_intersects(origin, span, corner, edge1, edge2);
        const bool stands = segment_intersects_small(origin, span, corner, edge1, edge2, side);
        said[i] = u_select(opens, BD_PAIR_OPENS, 0u) | u_select(hides, BD_PAIR_HIDES, 0u) |
                  u_select(stands, BD_PAIR_STANDS, 0u);
    }
}
