#include "net/scene_objects.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/answer.h"

#define NEW(Name, name, variable)                                                                  \
    Bounced__##Name *variable = malloc(sizeof *variable);                                          \
    BD_ASSERT(variable);                                                                           \
    bounced__##name##__init(variable)

static double *numbers(const float *from, size_t count, size_t *n)
{
    double *list = malloc(count * sizeof *list);
    BD_ASSERT(list);
    for (size_t i = 0; i < count; i++) list[i] = (double)from[i];
    *n = count;
    return list;
}

static double *matrix(const bd_dmat4 *from, size_t *n)
{
    double *list = malloc(16 * sizeof *list);
    BD_ASSERT(list);
    memcpy(list, from->m, 16 * sizeof *list);
    *n = 16;
    return list;
}

static Bounced__SceneObject *add(Bounced__Scene *message, const char *kind, uint32_t id,
                                 const char *name)
{
    NEW(SceneObject, scene_object, object);
    object->kind = bd_answer_text(kind);
    BD_SET(object, id, (int32_t)id);
    object->name = bd_answer_text(name);
    message->objects[message->n_objects++] = object;
    return object;
}

static void add_node(Bounced__Scene *message, uint32_t id, const struct bd_node *node)
{
    Bounced__SceneObject *object = add(message, "node", id, node->name);
    NEW(NodeEdit, node_edit, edit);
    BD_SET(edit, parent, node->parent);
    BD_SET(edit, mesh, node->mesh);
    BD_SET(edit, camera, node->camera);
    BD_SET(edit, light, node->light);
    BD_SET(edit, shown, !node->is_hidden);
    NEW(TransformEdit, transform_edit, transform);
    transform->matrix = matrix(&node->parent_from_node, &transform->n_matrix);
    edit->transform = transform;
    object->node = edit;
    object->world_from_node = matrix(&node->world_from_node, &object->n_world_from_node);
}

static void add_light(Bounced__Scene *message, uint32_t id, const struct bd_light *light)
{
    static const char *const kinds[] = {"directional", "point", "spot"};
    Bounced__SceneObject *object = add(message, "light", id, light->name);
    NEW(LightEdit, light_edit, edit);
    edit->kind = bd_answer_text(kinds[light->kind]);
    edit->color = numbers(light->color, 3, &edit->n_color);
    BD_SET(edit, intensity, (double)light->intensity);
    BD_SET(edit, range, isinf(light->range_m) ? 0 : (double)light->range_m);
    if (light->kind == BD_LIGHT_SPOT) {
        BD_SET(edit, cone_inner, (double)light->cone_inner);
        BD_SET(edit, cone_outer, (double)light->cone_outer);
    }
    object->light = edit;
}

static void add_camera(Bounced__Scene *message, uint32_t id, const struct bd_camera *camera)
{
    Bounced__SceneObject *object = add(message, "camera", id, camera->name);
    NEW(CameraEdit, camera_edit, edit);
    BD_SET(edit, orthographic, camera->orthographic);
    if (camera->orthographic) {
        BD_SET(edit, xmag, (double)camera->xmag);
        BD_SET(edit, ymag, (double)camera->ymag);
    } else {
        BD_SET(edit, yfov, (double)camera->yfov);
    }
    BD_SET(edit, near, (double)camera->near_m);
    BD_SET(edit, far, isinf(camera->far_m) ? 0 : (double)camera->far_m);
    object->camera = edit;
}

static void add_material(Bounced__Scene *message, uint32_t id, const struct bd_material *material)
{
    static const char *const modes[] = {"opaque", "mask", "blend"};
    Bounced__SceneObject *object = add(message, "material", id, material->name);
    NEW(MaterialEdit, material_edit, edit);
    edit->base_color = numbers(material->base_color, 4, &edit->n_base_color);
    edit->emissive = numbers(material->emissive, 3, &edit->n_emissive);
    edit->attenuation_color = numbers(material->attenuation_color, 3, &edit->n_attenuation_color);
    edit->alpha_mode = bd_answer_text(modes[material->alpha_mode]);
    BD_SET(edit, metallic, (double)material->metallic);
    BD_SET(edit, roughness, (double)material->roughness);
    BD_SET(edit, normal_scale, (double)material->normal_scale);
    BD_SET(edit, ior, (double)material->ior);
    BD_SET(edit, transmission, (double)material->transmission);
    BD_SET(edit, thickness, (double)material->thickness_m);
    BD_SET(edit, attenuation_distance,
           isinf(material->attenuation_distance_m) ? 0 : (double)material->attenuation_distance_m);
    BD_SET(edit, alpha_cutoff, (double)material->alpha_cutoff);
    BD_SET(edit, double_sided, material->double_sided);
    BD_SET(edit, unlit, material->unlit);
    BD_SET(edit, base_color_texture, material->base_color_map.texture);
    BD_SET(edit, metallic_roughness_texture, material->metallic_roughness_map.texture);
    BD_SET(edit, normal_texture, material->normal_map.texture);
    BD_SET(edit, emissive_texture, material->emissive_map.texture);
    BD_SET(edit, transmission_texture, material->transmission_map.texture);
    object->material = edit;
}

static void add_texture(Bounced__Scene *message, uint32_t id, const struct bd_texture *texture)
{
    static const char *const wraps[] = {"repeat", "clamp", "mirror"};
    Bounced__SceneObject *object = add(message, "texture", id, "");
    NEW(TextureEdit, texture_edit, edit);
    edit->wrap_s = bd_answer_text(wraps[texture->wrap_s]);
    edit->wrap_t = bd_answer_text(wraps[texture->wrap_t]);
    BD_SET(edit, nearest, texture->nearest);
    object->texture = edit;
}

static void add_mesh(Bounced__Scene *message, uint32_t id, const struct bd_mesh *mesh)
{
    Bounced__SceneObject *object = add(message, "mesh", id, mesh->name);
    float least[3] = {INFINITY, INFINITY, INFINITY}, most[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t p = 0; p < mesh->primitive_count; p++)
        for (int c = 0; c < 3; c++) {
            least[c] = fminf(least[c], mesh->primitives[p].bounds_min[c]);
            most[c] = fmaxf(most[c], mesh->primitives[p].bounds_max[c]);
        }
    if (!(least[0] <= most[0])) return; // nothing to bound
    object->bounds_min = numbers(least, 3, &object->n_bounds_min);
    object->bounds_max = numbers(most, 3, &object->n_bounds_max);
}

void bd_scene_objects_fill(Bounced__Scene *message, const struct bd_scene *scene)
{
    size_t most = (size_t)scene->node_count + scene->mesh_count + scene->material_count +
                  scene->texture_count + scene->authored_light_count + scene->authored_camera_count;
    message->objects = calloc(most + 1, sizeof *message->objects);
    BD_ASSERT(message->objects);
    for (uint32_t i = 0; i < scene->node_count; i++)
        if (!scene->nodes[i].is_removed) add_node(message, i, &scene->nodes[i]);
    for (uint32_t i = 0; i < scene->mesh_count; i++)
        if (!scene->meshes[i]->is_removed) add_mesh(message, i, scene->meshes[i]);
    for (uint32_t i = 0; i < scene->material_count; i++)
        if (!scene->materials[i].is_removed) add_material(message, i, &scene->materials[i]);
    for (uint32_t i = 0; i < scene->texture_count; i++)
        if (!scene->textures[i].is_removed) add_texture(message, i, &scene->textures[i]);
    for (uint32_t i = 0; i < scene->authored_light_count; i++)
        if (!scene->lights[i].is_removed) add_light(message, i, &scene->lights[i]);
    for (uint32_t i = 0; i < scene->authored_camera_count; i++)
        if (!scene->cameras[i].is_removed) add_camera(message, i, &scene->cameras[i]);
}
