// References between objects: that each leads to one that is there.

#include <stdio.h>

#include "scene/model/object_fields.h"
#include "scene/model/scene.h"

// What refers, for the error.
struct referrer {
    const char *kind;
    uint32_t id;
    struct bd_err_detail *detail;
};

static bool complain(const struct referrer *from, const char *what, int32_t id)
{
    char field[64];
    snprintf(field, sizeof field, "%ss[%u].%s", from->kind, from->id, what);
    (void)bd_err_set(from->detail, BD_ERR_BAD_INPUT, field,
                     "%s %u refers to %s %d, which is not there", from->kind, from->id, what, id);
    return false;
}

// BD_NONE, or below `count` and not removed; from what is removed itself, only BD_NONE.
#define HOLDS(from, removed, what, id, count, items, is_removed_at)                                \
    ((id) == BD_NONE ||                                                                            \
     (!(removed) && (id) >= 0 && (uint32_t)(id) < (count) && !(items)[id] is_removed_at) ||        \
     complain(from, what, id))

static bool node_holds(const struct bd_scene *s, uint32_t id, struct bd_err_detail *detail)
{
    const struct bd_node *node = &s->nodes[id];
    const struct referrer from = {"node", id, detail};
    bool gone = node->is_removed;
    return HOLDS(&from, gone, "parent", node->parent, s->node_count, s->nodes, .is_removed) &&
           HOLDS(&from, gone, "mesh", node->mesh, s->mesh_count, s->meshes, ->is_removed) &&
           HOLDS(&from, gone, "camera", node->camera, s->camera_count, s->cameras, .is_removed) &&
           HOLDS(&from, gone, "light", node->light, s->light_count, s->lights, .is_removed);
}

static bool material_holds(const struct bd_scene *s, uint32_t id, struct bd_err_detail *detail)
{
    const struct bd_material *m = &s->materials[id];
    const struct referrer from = {"material", id, detail};
    const struct bd_texture_ref *map;
    for (uint32_t n = 0; (map = bd_material_map(m, n)); n++)
        if (!HOLDS(&from, m->is_removed, "texture", map->texture, s->texture_count, s->textures,
                   .is_removed))
            return false;
    return true;
}

static bool texture_holds(const struct bd_scene *s, uint32_t id, struct bd_err_detail *detail)
{
    const struct bd_texture *texture = &s->textures[id];
    const struct referrer from = {"texture", id, detail};
    return HOLDS(&from, texture->is_removed, "picture", texture->picture, s->picture_count,
                 s->pictures, ->is_removed);
}

// Every primitive has a material.
static bool mesh_holds(const struct bd_scene *s, uint32_t id, struct bd_err_detail *detail)
{
    const struct bd_mesh *mesh = s->meshes[id];
    const struct referrer from = {"mesh", id, detail};
    for (uint32_t p = 0; p < mesh->primitive_count; p++) {
        int32_t material = mesh->primitives[p].material;
        if (material == BD_NONE) return complain(&from, "material", material);
        if (!HOLDS(&from, mesh->is_removed, "material", material, s->material_count, s->materials,
                   .is_removed))
            return false;
    }
    return true;
}

enum bd_err bd_scene_check_references(const struct bd_scene *scene, struct bd_err_detail *detail)
{
    bool holds = true;
    for (uint32_t i = 0; holds && i < scene->texture_count; i++)
        holds = texture_holds(scene, i, detail);
    for (uint32_t i = 0; holds && i < scene->material_count; i++)
        holds = material_holds(scene, i, detail);
    for (uint32_t i = 0; holds && i < scene->mesh_count; i++) holds = mesh_holds(scene, i, detail);
    for (uint32_t i = 0; holds && i < scene->node_count; i++) holds = node_holds(scene, i, detail);
    if (!holds) return BD_ERR_BAD_INPUT;
    uint32_t looping = UINT32_MAX;
    if (bd_scene_parents_are_a_forest(scene, &looping)) return BD_ERR_OK;
    if (looping == UINT32_MAX)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "nodes", "no memory for %u nodes",
                          scene->node_count);
    return bd_err_set(detail, BD_ERR_BAD_INPUT, "nodes", "node %u is among its own ancestors",
                      looping);
}
