#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/gltf_reader.h"

// A factor outside its range (or a number that no float holds) is clamped, and counted.
static float clamped(struct bd_gltf_reader *reader, double value, double least, double most)
{
    if (value >= least && value <= most) return (float)value;
    reader->repairs.clamped_factors++;
    return (float)(value > most ? most : least);
}

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
    *out = (struct bd_texture_ref){.texture = BD_NONE, .uv_transform = {1, 0, 0, 0, 1, 0}};
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

static void read_maps(struct bd_gltf_reader *reader, const struct bd_gltf_material *in,
                      struct bd_gltf_uv_slots *slots, struct bd_material *out)
{
    const struct {
        const struct bd_gltf_texture_info *info;
        struct bd_texture_ref *ref;
    } maps[] = {{&in->base_color_map, &out->base_color_map},
                {&in->metallic_roughness_map, &out->metallic_roughness_map},
                {&in->normal_map, &out->normal_map},
                {&in->emissive_map, &out->emissive_map},
                {&in->transmission_map, &out->transmission_map}};
    const size_t count = sizeof maps / sizeof maps[0];
    bool in_use[2] = {false, false};
    *slots = (struct bd_gltf_uv_slots){{0, 1}};
    for (size_t i = 0; i < count; i++) mark_use(maps[i].info, in_use);
    for (size_t i = 0; i < count; i++) read_ref(reader, maps[i].info, slots, in_use, maps[i].ref);
}

static enum bd_alpha_mode alpha_mode_of(const char *name)
{
    if (strcmp(name, "MASK") == 0) return BD_ALPHA_MASK;
    return strcmp(name, "BLEND") == 0 ? BD_ALPHA_BLEND : BD_ALPHA_OPAQUE;
}

static float distance_of(double value)
{
    return value > 0 && value <= FLT_MAX ? (float)value : INFINITY;
}

static void read_material(struct bd_gltf_reader *reader, const struct bd_gltf_material *in,
                          struct bd_gltf_uv_slots *slots, struct bd_material *out)
{
    bd_gltf_copy_name(out->name, in->name);
    for (int i = 0; i < 4; i++) out->base_color[i] = clamped(reader, in->base_color[i], 0, 1);
    for (int i = 0; i < 3; i++) {
        float factor = clamped(reader, in->emissive[i], 0, 1);
        out->emissive[i] = factor * clamped(reader, in->emissive_strength, 0, 1e30);
        out->attenuation_color[i] = clamped(reader, in->attenuation_color[i], 0, 1);
    }
    out->metallic = clamped(reader, in->metallic, 0, 1);
    out->roughness = clamped(reader, in->roughness, 0, 1);
    out->normal_scale = clamped(reader, in->normal_scale, -1e6, 1e6);
    // 0 is the extension's word for "behaves like a mirror"; between 0 and 1 means nothing.
    out->ior = in->ior == 0 ? 0 : clamped(reader, in->ior, 1, 1e6);
    out->transmission = clamped(reader, in->transmission, 0, 1);
    out->thickness_m = clamped(reader, in->thickness, 0, BD_COORDINATE_MAX_M);
    out->attenuation_distance_m = distance_of(in->attenuation_distance);
    out->alpha_mode = alpha_mode_of(in->alpha_mode);
    out->alpha_cutoff = clamped(reader, in->alpha_cutoff, 0, 1e6);
    out->double_sided = in->double_sided;
    out->unlit = in->unlit;
    read_maps(reader, in, slots, out);
}

// glTF's default material, for primitives that name none.
static const struct bd_gltf_material default_material = {
    .name = "default",
    .base_color = {1, 1, 1, 1},
    .metallic = 1,
    .roughness = 1,
    .emissive_strength = 1,
    .normal_scale = 1,
    .ior = 1.5,
    .attenuation_distance = INFINITY,
    .attenuation_color = {1, 1, 1},
    .alpha_mode = "OPAQUE",
    .alpha_cutoff = 0.5,
    .base_color_map = {.texture = BD_NONE},
    .metallic_roughness_map = {.texture = BD_NONE},
    .normal_map = {.texture = BD_NONE},
    .emissive_map = {.texture = BD_NONE},
    .transmission_map = {.texture = BD_NONE},
};

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
        read_material(reader, &doc->materials[i], &reader->uv_slots[i], &scene->materials[i]);
    scene->material_count = doc->material_count;
    if (needs_default(doc)) {
        uint32_t last = scene->material_count++;
        read_material(reader, &default_material, &reader->uv_slots[last], &scene->materials[last]);
    }
    return BD_ERR_OK;
}
