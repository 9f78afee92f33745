// A scene under a node of another: everything of it gets the next slots, and what it refers to is
// moved by as much.

#include <stdlib.h>
#include <string.h>

#include "scene/edit/edit_parts.h"
#include "scene/model/derive.h"

static int32_t moved(int32_t id, uint32_t by)
{
    return id == BD_NONE ? BD_NONE : id + (int32_t)by;
}

static void import_pictures(struct bd_edit *edit, const struct bd_scene *from)
{
    for (uint32_t i = 0; i < from->picture_count; i++) {
        uint32_t id = bd_edit_next(edit, BD_OBJECT_PICTURE);
        bd_picture_release(&edit->draft->pictures[id]);
        edit->draft->pictures[id] = bd_picture_retain(from->pictures[i]);
    }
}

static void import_textures(struct bd_edit *edit, const struct bd_scene *from, uint32_t pictures)
{
    for (uint32_t i = 0; i < from->texture_count; i++) {
        uint32_t id = bd_edit_next(edit, BD_OBJECT_TEXTURE);
        edit->draft->textures[id] = from->textures[i];
        const int32_t picture = moved(from->textures[i].picture, pictures);
        edit->draft->textures[id].picture = picture;
        if (edit->picture_users && picture != BD_NONE) edit->picture_users[picture]++;
    }
}

static void import_materials(struct bd_edit *edit, const struct bd_scene *from, uint32_t textures)
{
    for (uint32_t i = 0; i < from->material_count; i++) {
        struct bd_material material = from->materials[i];
        struct bd_texture_ref *map;
        for (uint32_t n = 0; (map = bd_material_map(&material, n)); n++)
            map->texture = moved(map->texture, textures);
        edit->draft->materials[bd_edit_next(edit, BD_OBJECT_MATERIAL)] = material;
    }
}

static void import_lights_and_cameras(struct bd_edit *edit, const struct bd_scene *from)
{
    for (uint32_t i = 0; i < from->authored_light_count; i++)
        edit->draft->lights[bd_edit_next(edit, BD_OBJECT_LIGHT)] = from->lights[i];
    for (uint32_t i = 0; i < from->authored_camera_count; i++)
        edit->draft->cameras[bd_edit_next(edit, BD_OBJECT_CAMERA)] = from->cameras[i];
}

static void import_meshes(struct bd_edit *edit, const struct bd_scene *from, uint32_t materials)
{
    for (uint32_t i = 0; i < from->mesh_count; i++) {
        struct bd_mesh *alias = bd_mesh_alias(from->meshes[i]);
        if (!alias) {
            bd_edit_fail_memory(edit);
            return;
        }
        for (uint32_t p = 0; p < alias->primitive_count; p++)
            alias->primitives[p].material = moved(alias->primitives[p].material, materials);
        uint32_t id = bd_edit_next(edit, BD_OBJECT_MESH);
        bd_mesh_release(&edit->draft->meshes[id]);
        edit->draft->meshes[id] = alias;
    }
}

// Where each node of the scene comes to lie; BD_NONE for those that it does not show.
static int32_t *number_nodes(struct bd_edit *edit, const struct bd_scene *from)
{
    int32_t *ids = malloc((from->node_count + (size_t)1) * sizeof *ids);
    if (!ids) bd_edit_fail_memory(edit);
    for (uint32_t i = 0; ids && i < from->node_count; i++)
        ids[i] = from->nodes[i].in_scene ? (int32_t)bd_edit_next(edit, BD_OBJECT_NODE) : BD_NONE;
    return ids;
}

// A mesh that was baked in the scene's space stands still in it: on a node of its own right under
// the new one, so that it moves with that.
static void set_apart(struct bd_edit *edit, struct bd_node *node, int32_t root)
{
    uint32_t id = bd_edit_next(edit, BD_OBJECT_NODE);
    struct bd_node apart = bd_node_removed;
    apart.is_removed = false;
    memcpy(apart.name, node->name, sizeof apart.name);
    apart.parent = root;
    apart.mesh = node->mesh;
    apart.parent_from_node = bd_dmat4_identity();
    edit->draft->nodes[id] = apart;
    node->mesh = BD_NONE;
    node->mesh_is_world_space = false;
}

static void import_nodes(struct bd_edit *edit, const struct bd_scene *from,
                         const struct bd_scene_counts *by, int32_t root)
{
    int32_t *ids = number_nodes(edit, from);
    for (uint32_t i = 0; ids && i < from->node_count; i++) {
        if (ids[i] == BD_NONE) continue;
        struct bd_node *node = &edit->draft->nodes[ids[i]];
        *node = from->nodes[i];
        node->parent = node->parent == BD_NONE ? root : ids[node->parent];
        node->mesh = moved(node->mesh, by->meshes);
        node->camera = moved(node->camera, by->cameras);
        node->light = moved(node->light, by->lights);
        if (node->mesh_is_world_space) set_apart(edit, node, root);
    }
    free(ids);
}

void bd_edit_import(struct bd_edit *edit, const struct bd_edit_op *op)
{
    const struct bd_import_edit *in = &op->import;
    int32_t parent = bd_edit_reference(edit, "parent", BD_OBJECT_NODE, in->parent);
    if (edit->err != BD_ERR_OK) return;
    int32_t root = (int32_t)bd_edit_next(edit, BD_OBJECT_NODE);
    struct bd_node *node = &edit->draft->nodes[root];
    *node = bd_node_removed;
    node->is_removed = false;
    node->parent = parent;
    node->parent_from_node = bd_dmat4_identity();
    if (in->name) bd_edit_name(edit, in->name, node->name);
    const struct bd_scene_counts by = edit->next;
    import_pictures(edit, in->scene);
    import_textures(edit, in->scene, by.pictures);
    import_materials(edit, in->scene, by.textures);
    import_lights_and_cameras(edit, in->scene);
    import_meshes(edit, in->scene, by.materials);
    import_nodes(edit, in->scene, &by, root);
    edit->ids[edit->op] = root;
}
