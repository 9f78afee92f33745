// Removals of a batch take effect at its end: what is below a removed node goes with it, and then
// nothing that is left may refer to what is gone. So a batch may remove a mesh before the node that
// shows it.

#include <stdlib.h>

#include "scene/edit/edit_parts.h"
#include "scene/model/derive.h"

static void empty_slot(struct bd_edit *edit, enum bd_object_kind kind, uint32_t id)
{
    struct bd_scene *draft = edit->draft;
    struct bd_mesh *mesh = NULL;
    struct bd_picture *picture = NULL;
    switch (kind) {
    case BD_OBJECT_PICTURE:
        picture = bd_picture_create_removed();
        if (!picture) break;
        bd_picture_release(&draft->pictures[id]);
        draft->pictures[id] = picture;
        return;
    case BD_OBJECT_TEXTURE:
        draft->textures[id] = bd_texture_removed;
        return;
    case BD_OBJECT_MATERIAL:
        draft->materials[id] = bd_material_removed;
        return;
    case BD_OBJECT_LIGHT:
        draft->lights[id] = bd_light_removed;
        return;
    case BD_OBJECT_CAMERA:
        draft->cameras[id] = bd_camera_removed;
        return;
    case BD_OBJECT_MESH:
        mesh = bd_mesh_create_removed();
        if (!mesh) break;
        bd_mesh_release(&draft->meshes[id]);
        draft->meshes[id] = mesh;
        return;
    case BD_OBJECT_NODE:
        draft->nodes[id].is_removed = true;
        return; // emptied below
    case BD_OBJECT_ENVIRONMENT:
    case BD_OBJECT_KIND_COUNT:
        return;
    }
    bd_edit_fail_memory(edit);
}

// A texture's picture goes with the last texture that shows it.
static void remove_texture(struct bd_edit *edit, uint32_t id)
{
    uint32_t *users = bd_edit_picture_users(edit);
    const int32_t picture = edit->draft->textures[id].picture;
    empty_slot(edit, BD_OBJECT_TEXTURE, id);
    if (!users || picture == BD_NONE || --users[picture] > 0) return;
    bd_edit_touch(edit, BD_OBJECT_PICTURE, (uint32_t)picture);
    empty_slot(edit, BD_OBJECT_PICTURE, (uint32_t)picture);
}

void bd_edit_remove(struct bd_edit *edit, enum bd_object_kind kind)
{
    int32_t id = bd_edit_target(edit, kind);
    if (id == BD_NONE) return;
    bd_edit_note(edit, &edit->removed, kind, (uint32_t)id);
    edit->has_removed_nodes |= kind == BD_OBJECT_NODE;
    if (kind == BD_OBJECT_TEXTURE)
        remove_texture(edit, (uint32_t)id);
    else
        empty_slot(edit, kind, (uint32_t)id);
}

// --- at the end -----------------------------------------------------------------------------

// Each node is asked once: what is known of a node above is handed down the path to it.
static void empty_subtrees(struct bd_edit *edit)
{
    struct bd_node *nodes = edit->draft->nodes;
    const uint32_t count = edit->next.nodes;
    enum { UNKNOWN, STAYS, GOES };
    uint8_t *fate = calloc(count + (size_t)1, 1);
    if (!fate) bd_edit_fail_memory(edit);
    for (uint32_t i = 0; fate && i < count; i++) {
        int32_t end = (int32_t)i;
        while (end != BD_NONE && fate[end] == UNKNOWN && !nodes[end].is_removed)
            end = nodes[end].parent;
        uint8_t found = end == BD_NONE ? STAYS : nodes[end].is_removed ? GOES : fate[end];
        for (int32_t n = (int32_t)i; n != end; n = nodes[n].parent) fate[n] = found;
        if (end != BD_NONE) fate[end] = found;
    }
    for (uint32_t i = 0; fate && i < count; i++) {
        if (fate[i] != GOES) continue;
        if (!nodes[i].is_removed) bd_edit_touch(edit, BD_OBJECT_NODE, i);
        nodes[i] = bd_node_removed;
    }
    free(fate);
}

static void complain(struct bd_edit *edit, const char *user, uint32_t user_id,
                     enum bd_object_kind kind, int32_t id)
{
    for (uint32_t i = 0; i < edit->removed.count; i++) {
        const struct bd_edit_place *place = &edit->removed.places[i];
        if (place->kind != kind || place->id != (uint32_t)id) continue;
        edit->op = place->op;
        bd_edit_fail(edit, BD_ERR_CONFLICT, "id", "%s %d is used by %s %u",
                     bd_object_kind_name(kind), id, user, user_id);
    }
}

static void check_nodes(struct bd_edit *edit)
{
    const struct bd_scene *draft = edit->draft;
    for (uint32_t i = 0; i < edit->next.nodes && edit->err == BD_ERR_OK; i++) {
        const struct bd_node *node = &draft->nodes[i];
        if (node->mesh != BD_NONE && draft->meshes[node->mesh]->is_removed)
            complain(edit, "node", i, BD_OBJECT_MESH, node->mesh);
        if (node->light != BD_NONE && draft->lights[node->light].is_removed)
            complain(edit, "node", i, BD_OBJECT_LIGHT, node->light);
        if (node->camera != BD_NONE && draft->cameras[node->camera].is_removed)
            complain(edit, "node", i, BD_OBJECT_CAMERA, node->camera);
    }
}

static void check_meshes(struct bd_edit *edit)
{
    const struct bd_scene *draft = edit->draft;
    for (uint32_t i = 0; i < edit->next.meshes && edit->err == BD_ERR_OK; i++)
        for (uint32_t p = 0; p < draft->meshes[i]->primitive_count; p++) {
            int32_t material = draft->meshes[i]->primitives[p].material;
            if (draft->materials[material].is_removed)
                complain(edit, "mesh", i, BD_OBJECT_MATERIAL, material);
        }
}

static void check_materials(struct bd_edit *edit)
{
    const struct bd_scene *draft = edit->draft;
    for (uint32_t i = 0; i < edit->next.materials && edit->err == BD_ERR_OK; i++) {
        const struct bd_material *m = &draft->materials[i];
        const struct bd_texture_ref *map;
        for (uint32_t n = 0; (map = bd_material_map(m, n)); n++)
            if (map->texture != BD_NONE && draft->textures[map->texture].is_removed)
                complain(edit, "material", i, BD_OBJECT_TEXTURE, map->texture);
    }
}

void bd_edit_settle_removals(struct bd_edit *edit)
{
    if (edit->removed.count == 0) return;
    empty_subtrees(edit);
    if (edit->err == BD_ERR_OK) check_nodes(edit);
    if (edit->err == BD_ERR_OK) check_meshes(edit);
    if (edit->err == BD_ERR_OK) check_materials(edit);
}
