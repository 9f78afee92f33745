// Edits of meshes: added, replaced, renamed, deformed.

#include <stdio.h>
#include <string.h>

#include "scene/edit/edit_parts.h"

static void store_mesh(struct bd_edit *edit, int32_t id, struct bd_mesh *mesh)
{
    bd_mesh_release(&edit->draft->meshes[id]);
    edit->draft->meshes[id] = mesh;
}

// The prepared mesh under the name and with the materials that it is to have here. NULL after a
// error.
static struct bd_mesh *prepared(struct bd_edit *edit, struct bd_mesh *mesh, const char *name)
{
    struct bd_mesh *alias = bd_mesh_alias(mesh);
    if (!alias) bd_edit_fail_memory(edit);
    if (alias) alias->is_removed = false; // of an empty slot's mesh, an empty mesh
    for (uint32_t p = 0; alias && p < alias->primitive_count; p++) {
        char field[48];
        int32_t *material = &alias->primitives[p].material;
        snprintf(field, sizeof field, "primitives[%u].material", p);
        *material = *material == BD_NONE
                        ? bd_edit_white_material(edit)
                        : bd_edit_reference(edit, field, BD_OBJECT_MATERIAL, *material);
    }
    if (alias) bd_edit_name(edit, name, alias->name);
    if (edit->err != BD_ERR_OK) bd_mesh_release(&alias);
    return alias;
}

static struct bd_mesh *renamed(struct bd_edit *edit, struct bd_mesh *mesh, const char *name)
{
    struct bd_mesh *alias = bd_mesh_alias(mesh);
    if (!alias) {
        bd_edit_fail_memory(edit);
        return NULL;
    }
    bd_edit_name(edit, name, alias->name);
    return alias;
}

static bool same_triangles(const struct bd_mesh *a, const struct bd_mesh *b)
{
    bool same = a->primitive_count == b->primitive_count;
    for (uint32_t p = 0; same && p < a->primitive_count; p++)
        same = a->primitives[p].vertex_count == b->primitives[p].vertex_count &&
               a->primitives[p].index_count == b->primitives[p].index_count;
    return same;
}

static void set_vertices(struct bd_edit *edit, int32_t id, struct bd_mesh *deformed)
{
    const struct bd_mesh *now = edit->draft->meshes[id];
    if (!same_triangles(now, deformed)) {
        bd_edit_fail(edit, BD_ERR_CONFLICT, "mesh", "mesh %d has other triangles meanwhile", id);
        return;
    }
    struct bd_mesh *alias = bd_mesh_alias(deformed);
    if (!alias) {
        bd_edit_fail_memory(edit);
        return;
    }
    memcpy(alias->name, now->name, sizeof alias->name);
    alias->is_removed = false;
    for (uint32_t p = 0; p < alias->primitive_count; p++)
        alias->primitives[p].material = now->primitives[p].material;
    store_mesh(edit, id, alias);
}

void bd_edit_mesh(struct bd_edit *edit, const struct bd_edit_op *op)
{
    const struct bd_mesh_edit *in = &op->mesh;
    bool adds = op->kind == BD_EDIT_ADD_MESH;
    if (!in->mesh && op->kind != BD_EDIT_SET_MESH) {
        bd_edit_fail(edit, BD_ERR_USAGE, adds ? "primitives" : "positions", "are needed");
        return;
    }
    int32_t id =
        adds ? (int32_t)bd_edit_next(edit, BD_OBJECT_MESH) : bd_edit_target(edit, BD_OBJECT_MESH);
    if (id == BD_NONE) return;
    if (op->kind == BD_EDIT_SET_MESH_VERTICES) {
        set_vertices(edit, id, in->mesh);
        return;
    }
    struct bd_mesh *now = edit->draft->meshes[id];
    const char *name = in->name ? in->name : now->name;
    struct bd_mesh *made = in->mesh ? prepared(edit, in->mesh, name) : renamed(edit, now, name);
    if (made) store_mesh(edit, id, made);
    if (adds) edit->ids[edit->op] = id;
}
