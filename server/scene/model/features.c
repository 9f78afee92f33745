// What a scene has, derived: bounds, what is emissive, which maps; by it frames leave out the rest.

#include <float.h>
#include <stddef.h>

#include "scene/model/derive.h"
#include "scene/model/object_fields.h"

static const double pi = 3.14159265358979323846;

static double luminance(const float rgb[3])
{
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

static void grow(struct bd_features *features, bd_dvec3 p)
{
    features->bounds_min.x = fmin(features->bounds_min.x, p.x);
    features->bounds_min.y = fmin(features->bounds_min.y, p.y);
    features->bounds_min.z = fmin(features->bounds_min.z, p.z);
    features->bounds_max.x = fmax(features->bounds_max.x, p.x);
    features->bounds_max.y = fmax(features->bounds_max.y, p.y);
    features->bounds_max.z = fmax(features->bounds_max.z, p.z);
}

static void grow_by_primitive(struct bd_features *features, const struct bd_primitive *primitive,
                              const bd_dmat4 *world_from_mesh)
{
    for (int corner = 0; corner < 8; corner++) {
        bd_dvec3 p = {corner & 1 ? primitive->bounds_max[0] : primitive->bounds_min[0],
                      corner & 2 ? primitive->bounds_max[1] : primitive->bounds_min[1],
                      corner & 4 ? primitive->bounds_max[2] : primitive->bounds_min[2]};
        grow(features, bd_dmat4_point(world_from_mesh, p));
    }
}

// Around the corners of every primitive's box: a little generous under rotation, exact without.
void bd_derive_bounds(struct bd_scene *scene)
{
    struct bd_features *features = &scene->features;
    features->bounds_min = (bd_dvec3){DBL_MAX, DBL_MAX, DBL_MAX};
    features->bounds_max = (bd_dvec3){-DBL_MAX, -DBL_MAX, -DBL_MAX};
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct bd_instance *instance = &scene->instances[i];
        const struct bd_mesh *mesh = scene->meshes[instance->mesh];
        for (uint32_t p = 0; p < mesh->primitive_count; p++)
            if (mesh->primitives[p].index_count > 0)
                grow_by_primitive(features, &mesh->primitives[p], &instance->world_from_mesh);
    }
    if (features->bounds_min.x > features->bounds_max.x)
        features->bounds_min = features->bounds_max = (bd_dvec3){0, 0, 0};
    features->diagonal_m =
        bd_dvec3_length(bd_dvec3_sub(features->bounds_max, features->bounds_min));
    if (!(features->diagonal_m > 0)) features->diagonal_m = 1;
}

static bool is_emissive(const struct bd_material *material)
{
    return material->emissive[0] > 0 || material->emissive[1] > 0 || material->emissive[2] > 0;
}

static bd_dvec3 vertex(const struct bd_primitive *primitive, uint32_t corner)
{
    const float *p = primitive->position + 3 * (size_t)primitive->index[corner];
    return (bd_dvec3){p[0], p[1], p[2]};
}

static double area_m2(const struct bd_primitive *primitive, const bd_dmat4 *world_from_mesh)
{
    double twice = 0;
    for (uint32_t i = 0; i < primitive->index_count; i += 3) {
        bd_dvec3 a = vertex(primitive, i);
        bd_dvec3 u = bd_dvec3_sub(vertex(primitive, i + 1), a);
        bd_dvec3 v = bd_dvec3_sub(vertex(primitive, i + 2), a);
        twice += bd_dvec3_length(bd_dvec3_cross(bd_dmat4_direction(world_from_mesh, u),
                                                bd_dmat4_direction(world_from_mesh, v)));
    }
    return 0.5 * twice;
}

static void add_maps(struct bd_features *features, const struct bd_material *material)
{
    const struct bd_texture_ref *map;
    for (uint32_t n = 0; (map = bd_material_map(material, n)); n++)
        features->has_uv1 |= map->texture != BD_NONE && map->uv_set == 1;
    features->has_base_color_map |= material->base_color_map.texture != BD_NONE;
    features->has_metallic_roughness_map |= material->metallic_roughness_map.texture != BD_NONE;
    features->has_normal_map |= material->normal_map.texture != BD_NONE;
    features->has_emissive_map |=
        material->emissive_map.texture != BD_NONE && is_emissive(material);
}

static void add_material(struct bd_features *features, const struct bd_material *material)
{
    bool metal = material->metallic > 0;
    bool has_map = material->metallic_roughness_map.texture != BD_NONE;
    bool transmissive = material->transmission > 0;
    features->has_mask |= material->alpha_mode == BD_ALPHA_MASK;
    features->has_blend |= material->alpha_mode == BD_ALPHA_BLEND;
    features->has_single_sided |= !material->double_sided;
    features->has_unlit |= material->unlit;
    features->has_emissive |= is_emissive(material);
    // An unlit surface shows its base colour and nothing else.
    if (material->unlit) return;
    features->has_metal |= metal;
    features->has_glossy |= metal || material->roughness < 0.6f;
    features->has_rough |= (material->metallic < 1 || has_map) && material->roughness >= 0.6f;
    features->has_mirror |= bd_material_may_mirror(material, BD_BRUSHED_ROUGHNESS);
    features->has_transmissive |= transmissive;
    features->has_pane |= bd_material_is_pane(material);
    features->has_lens |= transmissive && !bd_material_is_pane(material);
}

static void add_primitive(struct bd_scene *scene, const struct bd_instance *instance,
                          const struct bd_primitive *primitive)
{
    struct bd_features *features = &scene->features;
    const struct bd_material *material = &scene->materials[primitive->material];
    if (primitive->index_count == 0) return;
    features->triangle_count += primitive->index_count / 3;
    features->primitive_count++;
    features->has_vertex_color |= primitive->color != NULL;
    add_maps(features, material);
    add_material(features, material);
    if (is_emissive(material)) {
        double sides = material->double_sided ? 2 : 1;
        features->emissive_flux_lm += pi * luminance(material->emissive) * sides *
                                      area_m2(primitive, &instance->world_from_mesh);
    }
}

// Inside the cone the intensity falls as KHR_lights_punctual says: the square of a ramp in the
// cosine from the outer to the inner angle, whose integral is a third of the ramp's width.
static double spot_steradians(const struct bd_light *light)
{
    double inner = cos(light->cone_inner), outer = cos(light->cone_outer);
    return 2 * pi * ((1 - inner) + (inner - outer) / 3);
}

static double cross_section_m2(const struct bd_features *features, bd_dvec3 axis)
{
    bd_dvec3 size = bd_dvec3_sub(features->bounds_max, features->bounds_min);
    return fabs(axis.x) * size.y * size.z + fabs(axis.y) * size.z * size.x +
           fabs(axis.z) * size.x * size.y;
}

static double flux_lm(const struct bd_features *features, const struct bd_light *light,
                      const struct bd_placement *placed)
{
    double strength = luminance(light->color) * light->intensity;
    switch (light->kind) {
    case BD_LIGHT_DIRECTIONAL:
        return strength * cross_section_m2(features, placed->axis_z);
    case BD_LIGHT_POINT:
        return strength * 4 * pi;
    case BD_LIGHT_SPOT:
        return strength * spot_steradians(light);
    }
    return 0;
}

bool bd_environment_shines(const struct bd_environment *environment)
{
    const float *factor = environment->radiance;
    const struct bd_sky_map *map = environment->map;
    bool shines[3] = {factor[0] > 0, factor[1] > 0, factor[2] > 0};
    if (!map) return shines[0] || shines[1] || shines[2];
    for (size_t i = 0; i < 3 * (size_t)map->width_px * map->height_px; i++)
        if (shines[i % 3] && map->rgb[i] > 0) return true;
    return false;
}

void bd_environment_turn(struct bd_environment *environment, const double rotation[4])
{
    double length = 0, largest = 0;
    for (int c = 0; c < 4; c++) largest = fmax(largest, fabs(rotation[c]));
    for (int c = 0; c < 4; c++) length += rotation[c] / largest * (rotation[c] / largest);
    for (int c = 0; c < 4; c++)
        environment->rotation[c] = (float)(rotation[c] / largest / sqrt(length));
    const float *r = environment->rotation;
    // One way to say that it is not turned.
    if (r[0] == 0 && r[1] == 0 && r[2] == 0) environment->rotation[3] = 0;
}

bool bd_environment_is_turned(const struct bd_environment *environment)
{
    const float *r = environment->rotation;
    return r[0] != 0 || r[1] != 0 || r[2] != 0 || r[3] != 0;
}

void bd_environment_axes(const struct bd_environment *environment, bd_dvec3 axes[3])
{
    const float *r = environment->rotation;
    double x = r[0], y = r[1], z = r[2], w = r[3];
    const double length = sqrt(x * x + y * y + z * z + w * w);
    if (!(length > 0)) w = 1;
    if (length > 0) x /= length, y /= length, z /= length, w /= length;
    axes[0] = (bd_dvec3){1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)};
    axes[1] = (bd_dvec3){2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)};
    axes[2] = (bd_dvec3){2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)};
}

bd_dvec3 bd_scene_origin_m(const struct bd_features *features)
{
    const bd_dvec3 off_middle = {0.50137281, 0.49881733, 0.50092647};
    bd_dvec3 low = features->bounds_min, extent = bd_dvec3_sub(features->bounds_max, low);
    return (bd_dvec3){low.x + extent.x * off_middle.x, low.y + extent.y * off_middle.y,
                      low.z + extent.z * off_middle.z};
}

void bd_derive_surface_features(struct bd_scene *scene)
{
    struct bd_features *features = &scene->features;
    features->instance_count = scene->instance_count;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct bd_mesh *mesh = scene->meshes[scene->instances[i].mesh];
        for (uint32_t p = 0; p < mesh->primitive_count; p++)
            add_primitive(scene, &scene->instances[i], &mesh->primitives[p]);
    }
}

void bd_derive_light_features(struct bd_scene *scene)
{
    struct bd_features *features = &scene->features;
    for (uint32_t i = 0; i < scene->placed_light_count; i++) {
        const struct bd_light *light = &scene->lights[scene->placed_lights[i].object];
        features->light_count[light->kind]++;
        features->punctual_flux_lm += flux_lm(features, light, &scene->placed_lights[i]);
    }
}
