#include <float.h>
#include <math.h>

#include "scene/flat_io.h"

// The smallest forms of these are named where they are counted (flat.c).

void bd_flat_node(struct bd_flat_io *io, struct bd_node *node, const struct bd_scene_counts *counts)
{
    bd_flat_text(io, node->name, sizeof node->name);
    bd_flat_bool(io, &node->is_removed);
    bd_flat_index(io, &node->parent, counts->nodes);
    bd_flat_index(io, &node->mesh, counts->meshes);
    bd_flat_index(io, &node->camera, counts->cameras);
    bd_flat_index(io, &node->light, counts->lights);
    for (int i = 0; i < 16; i++) {
        bd_flat_bytes(io, &node->parent_from_node.m[i], sizeof(double));
        if (!isfinite(node->parent_from_node.m[i])) bd_flat_fail(io);
    }
    bd_flat_bool(io, &node->is_hidden);
    bd_flat_bool(io, &node->mesh_is_world_space);
}

static void visit_texture_ref(struct bd_flat_io *io, struct bd_texture_ref *ref,
                              const struct bd_scene_counts *counts)
{
    bd_flat_index(io, &ref->texture, counts->textures);
    bd_flat_u32(io, &ref->uv_set);
    if (ref->uv_set > 1) bd_flat_fail(io);
    bd_flat_f32s(io, ref->uv_transform, 6, -FLT_MAX, FLT_MAX);
}

void bd_flat_material(struct bd_flat_io *io, struct bd_material *material,
                      const struct bd_scene_counts *counts)
{
    bd_flat_text(io, material->name, sizeof material->name);
    bd_flat_bool(io, &material->is_removed);
    bd_flat_f32s(io, material->base_color, 4, 0, 1);
    bd_flat_f32(io, &material->metallic, 0, 1);
    bd_flat_f32(io, &material->roughness, 0, 1);
    bd_flat_f32s(io, material->emissive, 3, 0, FLT_MAX);
    bd_flat_f32(io, &material->normal_scale, -FLT_MAX, FLT_MAX);
    bd_flat_f32(io, &material->ior, 0, FLT_MAX);
    bd_flat_f32(io, &material->transmission, 0, 1);
    bd_flat_f32(io, &material->thickness_m, 0, FLT_MAX);
    bd_flat_f32(io, &material->attenuation_distance_m, 0, INFINITY);
    bd_flat_f32s(io, material->attenuation_color, 3, 0, 1);
    bd_flat_enum(io, &material->alpha_mode, BD_ALPHA_BLEND + 1);
    bd_flat_f32(io, &material->alpha_cutoff, 0, FLT_MAX);
    bd_flat_bool(io, &material->double_sided);
    bd_flat_bool(io, &material->unlit);
    visit_texture_ref(io, &material->base_color_map, counts);
    visit_texture_ref(io, &material->metallic_roughness_map, counts);
    visit_texture_ref(io, &material->normal_map, counts);
    visit_texture_ref(io, &material->emissive_map, counts);
    visit_texture_ref(io, &material->transmission_map, counts);
}

void bd_flat_texture(struct bd_flat_io *io, struct bd_texture *texture,
                     const struct bd_scene_counts *counts)
{
    bd_flat_bool(io, &texture->is_removed);
    bd_flat_index(io, &texture->picture, counts->pictures);
    bd_flat_enum(io, &texture->wrap_s, BD_WRAP_MIRROR + 1);
    bd_flat_enum(io, &texture->wrap_t, BD_WRAP_MIRROR + 1);
    bd_flat_bool(io, &texture->nearest);
}

void bd_flat_light(struct bd_flat_io *io, struct bd_light *light)
{
    const float half_pi = 1.57079637f;
    bd_flat_text(io, light->name, sizeof light->name);
    bd_flat_bool(io, &light->is_removed);
    bd_flat_enum(io, &light->kind, BD_LIGHT_SPOT + 1);
    bd_flat_f32s(io, light->color, 3, 0, FLT_MAX);
    bd_flat_f32(io, &light->intensity, 0, FLT_MAX);
    bd_flat_f32(io, &light->range_m, 0, INFINITY);
    bd_flat_f32(io, &light->cone_outer, 0, half_pi);
    bd_flat_f32(io, &light->cone_inner, 0, light->cone_outer);
}

void bd_flat_camera(struct bd_flat_io *io, struct bd_camera *camera)
{
    bd_flat_text(io, camera->name, sizeof camera->name);
    bd_flat_bool(io, &camera->is_removed);
    bd_flat_bool(io, &camera->orthographic);
    bd_flat_f32(io, &camera->yfov, 0, 3.14159f);
    bd_flat_f32(io, &camera->xmag, 0, FLT_MAX);
    bd_flat_f32(io, &camera->ymag, 0, FLT_MAX);
    bd_flat_f32(io, &camera->near_m, 0, FLT_MAX);
    bd_flat_f32(io, &camera->far_m, 0, INFINITY);
}
