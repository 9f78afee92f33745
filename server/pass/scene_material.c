#include "pass/scene_material.h"

#include "shared/bindings.h"

bool bd_material_has_holes(const struct bd_material *m)
{
    return m->alpha_mode != BD_ALPHA_OPAQUE;
}

static bool needs_color(const struct bd_scene_draws *draws, const struct bd_material *m)
{
    return draws->surface || bd_material_has_holes(m);
}

struct bd_defines bd_material_defines(const struct bd_scene_draws *draws,
                                      const struct bd_scene_draw *draw)
{
    const struct bd_material *m = draw->material;
    const struct bd_gpu_scene *scene = draws->scene;
    struct bd_defines defines = {0};
    if (draws->surface) bd_define(&defines, "BD_SURFACE", 1);
    if (draws->emission) bd_define(&defines, "BD_EMISSION", 1);
    if (draws->lambert) bd_define(&defines, "BD_LAMBERT", 1);
    // Who traces knows already what is there: alpha tested again at the interpolated point would
    // leave a pixel at a hole's rim without any surface.
    if (bd_material_has_holes(m) && !draws->tracer) bd_define(&defines, "BD_ALPHA_MASK", 1);
    if (needs_color(draws, m) && bd_gpu_scene_texture(scene, &m->base_color_map, true))
        bd_define(&defines, "BD_BASE_COLOR_MAP", 1);
    if (needs_color(draws, m) && draw->primitive->has[BD_STREAM_COLOR])
        bd_define(&defines, "BD_VERTEX_COLOR", 1);
    if (!draws->surface) return defines;
    if (!draws->lambert && bd_gpu_scene_texture(scene, &m->metallic_roughness_map, false))
        bd_define(&defines, "BD_METALLIC_ROUGHNESS_MAP", 1);
    if (draw->primitive->has[BD_STREAM_TANGENT] &&
        bd_gpu_scene_texture(scene, &m->normal_map, false))
        bd_define(&defines, "BD_NORMAL_MAP", 1);
    if (draws->glass && m->transmission > 0 &&
        bd_gpu_scene_texture(scene, &m->transmission_map, false))
        bd_define(&defines, "BD_TRANSMISSION_MAP", 1);
    if (draws->emission && bd_gpu_scene_texture(scene, &m->emissive_map, true))
        bd_define(&defines, "BD_EMISSIVE_MAP", 1);
    return defines;
}

static void set_uv_rows(struct bd_vec4 rows[2], const struct bd_texture_ref *ref)
{
    const float *m = ref->uv_transform;
    rows[0] = (struct bd_vec4){m[0], m[1], m[2], (float)ref->uv_set};
    rows[1] = (struct bd_vec4){m[3], m[4], m[5], 0};
}

// Reflectance at normal incidence of a dielectric of that index against air.
static float f0_of_ior(float ior)
{
    float r = (ior - 1) / (ior + 1);
    return r * r;
}

static float least_alpha_of(const struct bd_scene_draws *draws, const struct bd_scene_draw *draw)
{
    const struct bd_scene *scene = draws->scene->scene;
    const struct bd_triangle_run *run = draw->run;
    return bd_scene_least_alpha(scene,
                                scene->meshes[run->mesh]->primitives[run->primitive].material,
                                draws->viewpoint->sub_frame);
}

struct bd_material_uniform bd_material_uniform_of(const struct bd_scene_draws *draws,
                                                  const struct bd_scene_draw *draw)
{
    const struct bd_material *m = draw->material;
    float per_unit = (float)(1 / draws->scene->space.unit_cd_m2);
    const float unlit[3] = {1, 1, 1}; // an unlit surface shows its colour as 1 cd/m^2
    const float *e = m->unlit ? unlit : m->emissive;
    struct bd_material_uniform u = {
        .base_color = {m->base_color[0], m->base_color[1], m->base_color[2], m->base_color[3]},
        .emissive = {e[0] * per_unit, e[1] * per_unit, e[2] * per_unit, 0},
        .metallic = m->metallic,
        .roughness = m->roughness,
        .normal_scale = m->normal_scale,
        .transmission = draws->glass && !m->unlit ? m->transmission : 0,
        .f0_dielectric = f0_of_ior(m->ior),
        .alpha_cutoff = least_alpha_of(draws, draw),
        .flags = (m->double_sided ? BD_MATERIAL_DOUBLE_SIDED : 0) |
                 (m->unlit ? BD_MATERIAL_UNLIT : 0) |
                 (draw->run->mirrored ? BD_MATERIAL_MIRRORED : 0),
        .first_triangle = (uint32_t)draw->run->first_triangle,
        .triangles_per_instance = draw->run->triangles_per_instance,
    };
    set_uv_rows(u.base_color_uv, &m->base_color_map);
    set_uv_rows(u.metallic_roughness_uv, &m->metallic_roughness_map);
    set_uv_rows(u.normal_uv, &m->normal_map);
    set_uv_rows(u.emissive_uv, &m->emissive_map);
    set_uv_rows(u.transmission_uv, &m->transmission_map);
    return u;
}

static enum bd_tex_wrap tex_wrap(enum bd_wrap wrap)
{
    switch (wrap) {
    case BD_WRAP_REPEAT:
        return BD_TEX_REPEAT;
    case BD_WRAP_CLAMP:
        return BD_TEX_CLAMP;
    case BD_WRAP_MIRROR:
        return BD_TEX_MIRROR;
    }
    return BD_TEX_REPEAT;
}

static void bind_map(struct bd_bindings *bindings, uint32_t unit, const struct bd_gpu_scene *scene,
                     const struct bd_texture_ref *ref, bool srgb)
{
    const struct bd_tex *tex = bd_gpu_scene_texture(scene, ref, srgb);
    if (!tex) return;
    const struct bd_texture *texture = &scene->scene->textures[ref->texture];
    bindings->textures[unit].tex = tex;
    bindings->textures[unit].sampling = texture->nearest ? BD_SAMPLE_NEAREST : BD_SAMPLE_LINEAR;
    bindings->textures[unit].wrap_s = tex_wrap(texture->wrap_s);
    bindings->textures[unit].wrap_t = tex_wrap(texture->wrap_t);
}

void bd_material_bind_maps(struct bd_bindings *bindings, const struct bd_gpu_scene *scene,
                           const struct bd_material *m)
{
    bind_map(bindings, BD_UNIT_BASE_COLOR, scene, &m->base_color_map, true);
    bind_map(bindings, BD_UNIT_METALLIC_ROUGHNESS, scene, &m->metallic_roughness_map, false);
    bind_map(bindings, BD_UNIT_NORMAL, scene, &m->normal_map, false);
    bind_map(bindings, BD_UNIT_EMISSIVE, scene, &m->emissive_map, true);
    bind_map(bindings, BD_UNIT_TRANSMISSION, scene, &m->transmission_map, false);
}
