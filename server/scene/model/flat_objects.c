// Small objects in the flat form: a name, whether it is removed, and the fields of its rows.

#include <float.h>
#include <math.h>

#include "scene/model/delta.h"
#include "scene/model/flat_io.h"
#include "scene/model/object_fields.h"

// The smallest forms of these are named where they are counted (flat.c).

static void visit_map(struct bd_flat_io *io, struct bd_texture_ref *ref,
                      const struct bd_scene_counts *counts)
{
    bd_flat_index(io, &ref->texture, counts->textures);
    bd_flat_u32(io, &ref->uv_set);
    if (ref->uv_set > 1) bd_flat_fail(io);
    bd_flat_f32s(io, ref->uv_transform, 6, -FLT_MAX, FLT_MAX);
}

static uint32_t count_words(const char *const *words)
{
    uint32_t count = 0;
    while (words[count]) count++;
    return count;
}

static void visit_numbers(struct bd_flat_io *io, const struct bd_object_field *row, float *at)
{
    float least, most;
    bd_field_stored_range(row, &least, &most);
    bd_flat_f32s(io, at, (int)row->count, least, most);
}

// Names stand apart, before what tells whether the object is there.
static void visit_row(struct bd_flat_io *io, const struct bd_object_field *row, void *at,
                      const struct bd_scene_counts *counts)
{
    switch (row->type) {
    case BD_FIELD_SWITCH:
        bd_flat_bool(io, at);
        break;
    case BD_FIELD_NUMBERS:
        visit_numbers(io, row, at);
        break;
    case BD_FIELD_WORD:
        bd_flat_enum(io, at, count_words(row->words));
        break;
    case BD_FIELD_OBJECT:
        bd_flat_index(io, at, *bd_slots_of((struct bd_scene_counts *)counts, row->refers_to));
        break;
    case BD_FIELD_MAP:
        visit_map(io, at, counts);
        break;
    case BD_FIELD_NAME:
    case BD_FIELD_HEAVY:
        break;
    }
}

// Rows of the types from `first` to `last`, in the order of the table.
static void visit_rows(struct bd_flat_io *io, enum bd_object_kind kind, void *object,
                       enum bd_field_type first, enum bd_field_type last,
                       const struct bd_scene_counts *counts)
{
    const struct bd_object_field_list list = bd_object_fields(kind);
    for (uint32_t i = 0; i < list.count; i++)
        if (list.rows[i].type >= first && list.rows[i].type <= last)
            visit_row(io, &list.rows[i], bd_field_of(&list.rows[i], object), counts);
}

void bd_flat_node(struct bd_flat_io *io, struct bd_node *node, const struct bd_scene_counts *counts)
{
    bd_flat_text(io, node->name, sizeof node->name);
    bd_flat_bool(io, &node->is_removed);
    visit_rows(io, BD_OBJECT_NODE, node, BD_FIELD_OBJECT, BD_FIELD_OBJECT, counts);
    for (int i = 0; i < 16; i++) {
        bd_flat_bytes(io, &node->parent_from_node.m[i], sizeof(double));
        if (!isfinite(node->parent_from_node.m[i])) bd_flat_fail(io);
    }
    visit_rows(io, BD_OBJECT_NODE, node, BD_FIELD_SWITCH, BD_FIELD_SWITCH, counts);
    bd_flat_bool(io, &node->mesh_is_world_space);
}

void bd_flat_material(struct bd_flat_io *io, struct bd_material *material,
                      const struct bd_scene_counts *counts)
{
    bd_flat_text(io, material->name, sizeof material->name);
    bd_flat_bool(io, &material->is_removed);
    visit_rows(io, BD_OBJECT_MATERIAL, material, BD_FIELD_SWITCH, BD_FIELD_MAP, counts);
}

void bd_flat_texture(struct bd_flat_io *io, struct bd_texture *texture,
                     const struct bd_scene_counts *counts)
{
    bd_flat_bool(io, &texture->is_removed);
    bd_flat_index(io, &texture->picture, counts->pictures);
    visit_rows(io, BD_OBJECT_TEXTURE, texture, BD_FIELD_SWITCH, BD_FIELD_MAP, counts);
}

void bd_flat_light(struct bd_flat_io *io, struct bd_light *light)
{
    bd_flat_text(io, light->name, sizeof light->name);
    bd_flat_bool(io, &light->is_removed);
    visit_rows(io, BD_OBJECT_LIGHT, light, BD_FIELD_SWITCH, BD_FIELD_WORD, NULL);
    if (light->cone_inner > light->cone_outer) bd_flat_fail(io);
}

void bd_flat_camera(struct bd_flat_io *io, struct bd_camera *camera)
{
    bd_flat_text(io, camera->name, sizeof camera->name);
    bd_flat_bool(io, &camera->is_removed);
    visit_rows(io, BD_OBJECT_CAMERA, camera, BD_FIELD_SWITCH, BD_FIELD_NUMBERS, NULL);
}
