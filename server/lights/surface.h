// A point of a surface, as whoever lights or is lit finds it. Private to lights/.

#ifndef BD_LIGHTS_SURFACE_H
#define BD_LIGHTS_SURFACE_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#include "lights/map.h"
#include "lights/sent.h"
#include "lights/surface_points.h"
#include "scene/model/render_space.h"
#include "scene/model/triangle_order.h"

// A vertex of an instance, in render space.
static inline f3 bd_shading_vertex_of(const struct bd_render_space *space,
                                      const struct bd_instance *instance, const float position[3])
{
    const bd_dvec3 p = {position[0], position[1], position[2]};
    const bd_dvec3 r = bd_render_from_world(space, bd_dmat4_point(&instance->world_from_mesh, p));
    return f3_of((float)r.x, (float)r.y, (float)r.z);
}

// A triangle of an instance, in render space.
struct bd_triangle_place {
    f3 corner[3], normal; // unit, to its front
    float area;           // of one side
};

// Of a run's primitive, by its number there. False if it has no area.
static inline bool bd_triangle_place_of(const struct bd_render_space *space,
                                        const struct bd_triangle_run *run,
                                        const struct bd_instance *instance,
                                        const struct bd_primitive *primitive, uint32_t triangle,
                                        struct bd_triangle_place *place)
{
    const uint32_t *index = primitive->index + 3 * (size_t)triangle;
    for (int c = 0; c < 3; c++)
        place->corner[c] =
            bd_shading_vertex_of(space, instance, primitive->position + 3 * (size_t)index[c]);
    const f3 across = f3_cross(f3_sub(place->corner[1], place->corner[0]),
                               f3_sub(place->corner[2], place->corner[0]));
    const float twice = f3_length(across);
    if (!(twice > 0) || !isfinite(twice)) return false;
    place->normal = f3_scale(across, (run->mirrored ? -1 : 1) / twice);
    place->area = 0.5f * twice;
    return true;
}

static inline f3 bd_triangle_place_at(const struct bd_triangle_place *place, float u, float v)
{
    const f3 along = f3_scale(f3_sub(place->corner[1], place->corner[0]), u);
    const f3 across = f3_scale(f3_sub(place->corner[2], place->corner[0]), v);
    return f3_add(place->corner[0], f3_add(along, across));
}

// Linear: factor, vertex colour and map. `index`: the triangle's corners.
static inline struct bd_map_texel bd_base_color_at(const struct bd_scene *scene,
                                                   const struct bd_primitive *primitive,
                                                   const uint32_t index[3], float u, float v)
{
    const struct bd_material *m = &scene->materials[primitive->material];
    const struct bd_map_texel texel = bd_map_at(scene, &m->base_color_map, primitive, index, u, v);
    float color[4] = {1, 1, 1, 1};
    if (primitive->color) bd_stream_at(primitive->color, 4, index, u, v, color);
    const f3 factor = f3_of(m->base_color[0] * color[0], m->base_color[1] * color[1],
                            m->base_color[2] * color[2]);
    return (struct bd_map_texel){f3_mul(factor, texel.rgb),
                                 m->base_color[3] * color[3] * texel.alpha};
}

// KHR_materials_transmission: factor and map.
static inline float bd_transmission_at(const struct bd_scene *scene,
                                       const struct bd_primitive *primitive,
                                       const uint32_t index[3], float u, float v)
{
    const struct bd_material *m = &scene->materials[primitive->material];
    if (m->transmission == 0) return 0;
    return m->transmission *
           bd_map_data_at(scene, &m->transmission_map, primitive, index, u, v).rgb.x;
}

// Reflectance at normal incidence of a dielectric of that index against air.
static inline float bd_f0_of_ior(float ior)
{
    const float root = (ior - 1) / (ior + 1);
    return root * root;
}

// `cosine`: of all lobes, where light comes from (lights/sent.h).
static inline f3 bd_diffuse_of(const struct bd_scene *scene, const struct bd_primitive *primitive,
                               const uint32_t index[3], float u, float v, f3 base_color,
                               enum bd_sends sends, float cosine)
{
    const struct bd_material *m = &scene->materials[primitive->material];
    const bool is_diffuse = sends == BD_SENDS_DIFFUSE || sends == BD_SENDS_DIFFUSE_BESIDE_GLASS;
    if (sends == BD_SENDS_LAMBERT || (is_diffuse && m->metallic == 0)) return base_color;
    const f3 data = bd_map_data_at(scene, &m->metallic_roughness_map, primitive, index, u, v).rgb;
    const float metallic = m->metallic * data.z;
    if (is_diffuse) return f3_scale(base_color, 1 - metallic);
    return bd_sent_by_all(base_color, metallic, m->roughness * data.y, bd_f0_of_ior(m->ior),
                          cosine);
}

// What of the light that comes to a surface goes on as at glass or a mirror (lights/interface.h),
// which metals up to the roughness `roughest` are. `data`: its texel of metalness and roughness.
static inline float bd_share_of_interface(const struct bd_scene *scene,
                                          const struct bd_primitive *primitive,
                                          const uint32_t index[3], float u, float v, f3 data,
                                          float roughest)
{
    const struct bd_material *m = &scene->materials[primitive->material];
    const float metallic = m->metallic * data.z;
    if (m->transmission > 0)
        return (1 - metallic) * bd_transmission_at(scene, primitive, index, u, v);
    const bool mirrors = bd_material_may_mirror(m, roughest) && m->roughness * data.y <= roughest;
    return mirrors ? metallic : 0;
}

// Of what a surface sends on, what is left beside that, for lights that know it (enum bd_sends).
static inline f3 bd_sent_beside_interface(const struct bd_scene *scene,
                                          const struct bd_primitive *primitive,
                                          const uint32_t index[3], float u, float v,
                                          enum bd_sends sends, f3 diffuse)
{
    const struct bd_material *m = &scene->materials[primitive->material];
    const bool is_glass = m->transmission > 0;
    const float roughest =
        sends == BD_SENDS_BESIDE_MIRRORS ? BD_MIRROR_ROUGHNESS : BD_BRUSHED_ROUGHNESS;
    const bool is_beside = sends == BD_SENDS_BESIDE_MIRRORS || sends == BD_SENDS_BESIDE_INTERFACES;
    const bool is_told = sends == BD_SENDS_DIFFUSE_BESIDE_GLASS
                             ? is_glass
                             : is_beside && (is_glass || bd_material_may_mirror(m, roughest));
    if (!is_told) return diffuse;
    const f3 data = bd_map_data_at(scene, &m->metallic_roughness_map, primitive, index, u, v).rgb;
    return f3_scale(diffuse,
                    1 - bd_share_of_interface(scene, primitive, index, u, v, data, roughest));
}

// What blends is there where it is at least half opaque.
static inline bool bd_is_cut_out(const struct bd_material *material, float alpha)
{
    if (material->alpha_mode == BD_ALPHA_OPAQUE) return false;
    return alpha < (material->alpha_mode == BD_ALPHA_MASK ? material->alpha_cutoff : 0.5f);
}

#endif
