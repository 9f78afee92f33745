#include "tests/fuzz/derived.h"

#include <string.h>

#include "base/assert.h"
#include "base/hash.h"
#include "scene/model/derive.h"

#define ADD(sum, field) ((sum) = bd_hash64(&(field), sizeof(field), (sum)))

// --- aspects --------------------------------------------------------------------------------

static uint64_t of_geometry(const struct bd_scene *scene)
{
    uint64_t sum = scene->instance_count;
    for (uint32_t i = 0; i < scene->instance_count; i++)
        ADD(sum, scene->meshes[scene->instances[i].mesh]->sha256);
    return sum;
}

static uint64_t of_transforms(const struct bd_scene *scene)
{
    uint64_t sum = scene->instance_count;
    for (uint32_t i = 0; i < scene->instance_count; i++)
        ADD(sum, scene->instances[i].world_from_mesh);
    return sum;
}

static uint64_t add_map(uint64_t sum, const struct bd_scene *scene,
                        const struct bd_texture_ref *map)
{
    const bool is_there = map->texture != BD_NONE;
    ADD(sum, is_there);
    if (!is_there) return sum;
    const struct bd_texture *texture = &scene->textures[map->texture];
    ADD(sum, map->uv_set), ADD(sum, map->uv_transform);
    ADD(sum, texture->wrap_s), ADD(sum, texture->wrap_t), ADD(sum, texture->nearest);
    if (texture->picture != BD_NONE) ADD(sum, scene->pictures[texture->picture]->sha256);
    return sum;
}

static uint64_t add_alpha(uint64_t sum, const struct bd_scene *scene,
                          const struct bd_material *material)
{
    ADD(sum, material->alpha_mode);
    if (material->alpha_mode == BD_ALPHA_OPAQUE) return sum;
    ADD(sum, material->alpha_cutoff), ADD(sum, material->base_color[3]);
    return add_map(sum, scene, &material->base_color_map);
}

static uint64_t add_medium(uint64_t sum, const struct bd_scene *scene,
                           const struct bd_material *material)
{
    ADD(sum, material->transmission), ADD(sum, material->thickness_m), ADD(sum, material->ior);
    ADD(sum, material->attenuation_distance_m), ADD(sum, material->attenuation_color);
    return add_map(sum, scene, &material->transmission_map);
}

static void add_material(uint64_t sums[BD_ASPECT_COUNT], const struct bd_scene *scene,
                         const struct bd_material *material)
{
    uint64_t *colour = &sums[BD_ASPECT_COLOUR], *emission = &sums[BD_ASPECT_EMISSION];
    uint64_t *metalness = &sums[BD_ASPECT_METALNESS], *roughness = &sums[BD_ASPECT_ROUGHNESS];
    uint64_t *normals = &sums[BD_ASPECT_NORMALS], *sides = &sums[BD_ASPECT_SIDES];
    *colour = bd_hash64(material->base_color, 3 * sizeof(float), *colour);
    *colour = add_map(*colour, scene, &material->base_color_map);
    ADD(*metalness, material->metallic);
    *metalness = add_map(*metalness, scene, &material->metallic_roughness_map);
    ADD(*roughness, material->roughness), ADD(*roughness, material->ior);
    *roughness = add_map(*roughness, scene, &material->metallic_roughness_map);
    ADD(*emission, material->emissive), ADD(*emission, material->unlit);
    *emission = add_map(*emission, scene, &material->emissive_map);
    ADD(*normals, material->normal_scale);
    *normals = add_map(*normals, scene, &material->normal_map);
    ADD(*sides, material->double_sided), ADD(*sides, material->unlit);
    sums[BD_ASPECT_ALPHA] = add_alpha(sums[BD_ASPECT_ALPHA], scene, material);
    sums[BD_ASPECT_MEDIUM] = add_medium(sums[BD_ASPECT_MEDIUM], scene, material);
}

// Of what is drawn; a primitive without triangles shows none.
static void add_materials(uint64_t sums[BD_ASPECT_COUNT], const struct bd_scene *scene)
{
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct bd_mesh *mesh = scene->meshes[scene->instances[i].mesh];
        for (uint32_t p = 0; p < mesh->primitive_count; p++)
            if (mesh->primitives[p].index_count > 0)
                add_material(sums, scene, &scene->materials[mesh->primitives[p].material]);
    }
}

static uint64_t add_placement(uint64_t sum, const struct bd_placement *placement)
{
    ADD(sum, placement->position);
    return ADD(sum, placement->axis_x), ADD(sum, placement->axis_y), ADD(sum, placement->axis_z);
}

static uint64_t of_lights(const struct bd_scene *scene)
{
    uint64_t sum = scene->placed_light_count;
    for (uint32_t i = 0; i < scene->placed_light_count; i++) {
        const struct bd_light *light = &scene->lights[scene->placed_lights[i].object];
        sum = add_placement(sum, &scene->placed_lights[i]);
        ADD(sum, light->kind), ADD(sum, light->color), ADD(sum, light->intensity);
        ADD(sum, light->range_m), ADD(sum, light->cone_inner), ADD(sum, light->cone_outer);
    }
    return sum;
}

static uint64_t of_cameras(const struct bd_scene *scene)
{
    uint64_t sum = scene->placed_camera_count;
    for (uint32_t i = 0; i < scene->placed_camera_count; i++) {
        const struct bd_camera *camera = &scene->cameras[scene->placed_cameras[i].object];
        sum = add_placement(sum, &scene->placed_cameras[i]);
        ADD(sum, camera->orthographic), ADD(sum, camera->yfov), ADD(sum, camera->xmag);
        ADD(sum, camera->ymag), ADD(sum, camera->near_m), ADD(sum, camera->far_m);
    }
    return sum;
}

static uint64_t of_environment(const struct bd_environment *environment)
{
    uint64_t sum = 0;
    ADD(sum, environment->radiance);
    if (environment->map) ADD(sum, environment->map->sha256);
    return sum;
}

static uint64_t of_features(const struct bd_features *features)
{
    uint64_t sum = 0;
    ADD(sum, features->triangle_count), ADD(sum, features->instance_count);
    ADD(sum, features->primitive_count), ADD(sum, features->light_count);
    ADD(sum, features->has_base_color_map), ADD(sum, features->has_metallic_roughness_map);
    ADD(sum, features->has_normal_map), ADD(sum, features->has_emissive_map);
    ADD(sum, features->has_vertex_color), ADD(sum, features->has_uv1);
    ADD(sum, features->has_mask), ADD(sum, features->has_blend);
    ADD(sum, features->has_single_sided), ADD(sum, features->has_metal);
    ADD(sum, features->has_glossy), ADD(sum, features->has_mirror);
    ADD(sum, features->has_transmissive), ADD(sum, features->has_emissive);
    ADD(sum, features->has_unlit), ADD(sum, features->has_environment);
    ADD(sum, features->punctual_flux_lm), ADD(sum, features->emissive_flux_lm);
    ADD(sum, features->bounds_min), ADD(sum, features->bounds_max);
    return ADD(sum, features->diagonal_m);
}

struct derived derived_of(const struct bd_scene *scene)
{
    struct derived out = {.features = of_features(&scene->features)};
    out.aspects[BD_ASPECT_GEOMETRY] = of_geometry(scene);
    out.aspects[BD_ASPECT_TRANSFORMS] = of_transforms(scene);
    out.aspects[BD_ASPECT_LIGHTS] = of_lights(scene);
    out.aspects[BD_ASPECT_ENVIRONMENT] = of_environment(&scene->environment);
    out.aspects[BD_ASPECT_CAMERAS] = of_cameras(scene);
    add_materials(out.aspects, scene);
    return out;
}

// --- checks ---------------------------------------------------------------------------------

void derived_check_aspects(const struct bd_scene *before, const struct bd_scene *after)
{
    const struct derived a = derived_of(before), b = derived_of(after);
    const uint64_t *was = before->aspects.counter, *is = after->aspects.counter;
    const bool drew_the_same = was[BD_ASPECT_GEOMETRY] == is[BD_ASPECT_GEOMETRY];
    for (int i = 0; i < BD_ASPECT_COUNT; i++) {
        // Materials are those of what is drawn: where that is something else, all is drawn anew.
        if (BD_ASPECTS_MATERIALS >> i & 1 && !drew_the_same) continue;
        if (was[i] == is[i]) BD_ASSERT_CMP(a.aspects[i], ==, b.aspects[i]);
    }
}

void derived_check_from_scratch(const struct bd_scene *scene)
{
    const struct bd_scene_counts none = {0};
    struct bd_scene *again = bd_scene_copy(scene, &none);
    BD_ASSERT(again);
    enum bd_err err = bd_scene_finish(again, NULL);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    const struct derived a = derived_of(scene), b = derived_of(again);
    for (int i = 0; i < BD_ASPECT_COUNT; i++) BD_ASSERT_CMP(a.aspects[i], ==, b.aspects[i]);
    BD_ASSERT_CMP(a.features, ==, b.features);
    BD_ASSERT_CMP(scene->flags.count, ==, again->flags.count);
    bd_scene_release(&again);
}
