#include "net/wire/scene_objects.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/wire/answer.h"
#include "net/wire/object_message.h"

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
    bd_object_message_fill(BD_OBJECT_NODE, node, &edit->base);
    NEW(TransformEdit, transform_edit, transform);
    transform->matrix = matrix(&node->parent_from_node, &transform->n_matrix);
    edit->transform = transform;
    object->node = edit;
    object->world_from_node = matrix(&node->world_from_node, &object->n_world_from_node);
}

static void add_light(Bounced__Scene *message, uint32_t id, const struct bd_light *light)
{
    NEW(LightEdit, light_edit, edit);
    bd_object_message_fill(BD_OBJECT_LIGHT, light, &edit->base);
    add(message, "light", id, light->name)->light = edit;
}

static void add_camera(Bounced__Scene *message, uint32_t id, const struct bd_camera *camera)
{
    NEW(CameraEdit, camera_edit, edit);
    bd_object_message_fill(BD_OBJECT_CAMERA, camera, &edit->base);
    add(message, "camera", id, camera->name)->camera = edit;
}

static void add_material(Bounced__Scene *message, uint32_t id, const struct bd_material *material)
{
    NEW(MaterialEdit, material_edit, edit);
    bd_object_message_fill(BD_OBJECT_MATERIAL, material, &edit->base);
    add(message, "material", id, material->name)->material = edit;
}

static void add_texture(Bounced__Scene *message, uint32_t id, const struct bd_texture *texture)
{
    NEW(TextureEdit, texture_edit, edit);
    bd_object_message_fill(BD_OBJECT_TEXTURE, texture, &edit->base);
    add(message, "texture", id, "")->texture = edit;
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
