// Materials, by the rows of their fields; what no row says: maps and their sets of coordinates.

#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "scene/gltf/gltf_reader.h"
#include "scene/model/object_fields.h"

// The material's two sets of coordinates are TEXCOORD_0 and _1 unless a map wants a later one,
// which then takes the place of a set that no map wants.
static bool slot_of(struct bd_gltf_uv_slots *slots, uint32_t wanted, bool in_use[2], uint32_t *slot)
{
    for (uint32_t i = 0; i < 2; i++)
        if (slots->set[i] == wanted) {
            *slot = i;
            return true;
        }
    for (uint32_t i = 0; i < 2; i++)
        if (!in_use[i]) {
            slots->set[i] = wanted;
            in_use[i] = true;
            *slot = i;
            return true;
        }
    return false;
}

static void read_ref(struct bd_gltf_reader *reader, const struct bd_gltf_texture_info *info,
                     struct bd_gltf_uv_slots *slots, bool in_use[2], struct bd_texture_ref *out)
{
    *out = bd_texture_ref_none;
    if (info->texture == BD_NONE) return;
    if (info->uv_set < 0 || !slot_of(slots, (uint32_t)info->uv_set, in_use, &out->uv_set)) {
        reader->repairs.uv_sets_ignored++;
        return;
    }
    out->texture = info->texture;
    bd_gltf_uv_matrix(info->offset, info->rotation, info->scale, out->uv_transform);
}

static void mark_use(const struct bd_gltf_texture_info *info, bool in_use[2])
{
    if (info->texture != BD_NONE && (info->uv_set == 0 || info->uv_set == 1))
        in_use[info->uv_set] = true;
}

static void read_maps(struct bd_gltf_reader *reader, uint32_t i, struct bd_gltf_uv_slots *slots,
                      struct bd_material *out)
{
    const struct bd_object_field *row;
    bool in_use[2] = {false, false};
    *slots = (struct bd_gltf_uv_slots){{0, 1}};
    for (uint32_t n = 0; (row = bd_material_map_row(n)); n++) {
        const struct bd_gltf_texture_info info = bd_gltf_material_map(reader->doc, i, row->gltf);
        mark_use(&info, in_use);
    }
    for (uint32_t n = 0; (row = bd_material_map_row(n)); n++) {
        const struct bd_gltf_texture_info info = bd_gltf_material_map(reader->doc, i, row->gltf);
        read_ref(reader, &info, slots, in_use, bd_material_map(out, n));
    }
}

// Numbers outside their range are clamped, and counted. Of those that have a scale, the file's own
// are factors up to 1, and the scale reaches as far as the row.
static void read_numbers(struct bd_gltf_reader *reader, uint32_t i,
                         const struct bd_object_field *row, float *out)
{
    static const struct bd_object_field factor = {.most = 1};
    uint32_t *clamped = &reader->repairs.clamped_factors;
    double numbers[4], scale = 1;
    for (uint32_t n = 0; n < row->count; n++) numbers[n] = row->standard;
    bd_gltf_material_numbers(reader->doc, i, row->gltf, row->count, numbers);
    if (row->gltf_scale) bd_gltf_material_numbers(reader->doc, i, row->gltf_scale, 1, &scale);
    for (uint32_t n = 0; n < row->count; n++) {
        out[n] = bd_field_clamped(row->gltf_scale ? &factor : row, numbers[n], clamped);
        if (row->gltf_scale) out[n] *= bd_field_clamped(row, scale, clamped);
    }
}

static void read_word(const struct bd_object_field *row, const char *text, void *out)
{
    for (int word = 0; row->words[word]; word++)
        if (strcasecmp(row->words[word], text) == 0) memcpy(out, &word, sizeof word);
}

static void read_field(struct bd_gltf_reader *reader, uint32_t i, const struct bd_object_field *row,
                       void *out)
{
    if (!row->gltf) return;
    if (row->type == BD_FIELD_NUMBERS) read_numbers(reader, i, row, out);
    if (row->type == BD_FIELD_SWITCH)
        *(bool *)out = bd_gltf_material_switch(reader->doc, i, row->gltf);
    if (row->type == BD_FIELD_WORD)
        read_word(row, bd_gltf_material_text(reader->doc, i, row->gltf), out);
}

static void read_material(struct bd_gltf_reader *reader, uint32_t i, struct bd_gltf_uv_slots *slots,
                          struct bd_material *out)
{
    const struct bd_object_field_list list = bd_object_fields(BD_OBJECT_MATERIAL);
    bd_object_set_standards(BD_OBJECT_MATERIAL, out);
    bd_gltf_copy_name(out->name, bd_gltf_material_name(reader->doc, i));
    for (uint32_t n = 0; n < list.count; n++)
        read_field(reader, i, &list.rows[n], bd_field_of(&list.rows[n], out));
    read_maps(reader, i, slots, out);
}

static bool needs_default(const struct bd_gltf_document *doc)
{
    for (uint32_t m = 0; m < doc->mesh_count; m++)
        for (uint32_t p = 0; p < doc->meshes[m].primitive_count; p++)
            if (doc->meshes[m].primitives[p].material == BD_NONE) return true;
    return false;
}

enum bd_err bd_gltf_read_materials(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    struct bd_scene *scene = reader->scene;
    size_t count = doc->material_count + (size_t)1;
    scene->materials = calloc(count, sizeof *scene->materials);
    reader->uv_slots = calloc(count, sizeof *reader->uv_slots);
    if (!scene->materials || !reader->uv_slots) return bd_gltf_no_memory(reader, "materials");
    for (uint32_t i = 0; i < doc->material_count; i++)
        read_material(reader, i, &reader->uv_slots[i], &scene->materials[i]);
    scene->material_count = doc->material_count;
    if (needs_default(doc)) {
        uint32_t last = scene->material_count++;
        bd_object_set_standards(BD_OBJECT_MATERIAL, &scene->materials[last]);
        bd_gltf_copy_name(scene->materials[last].name, "default");
        reader->uv_slots[last] = (struct bd_gltf_uv_slots){{0, 1}};
    }
    return BD_ERR_OK;
}
