// Who is written, and under which number: slots without their gaps, materials once more where some
// primitive cannot show all of their maps.

#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_write_parts.h"
#include "scene/model/derive.h"
#include "scene/model/object_fields.h"

static int32_t *no_numbers(uint32_t count)
{
    int32_t *numbers = malloc((count + (size_t)1) * sizeof *numbers);
    for (uint32_t i = 0; numbers && i < count; i++) numbers[i] = BD_NONE;
    return numbers;
}

// Numbers `items[0 .. count)` that are there, and says how many they are.
#define NUMBER(numbers, items, count, is_removed_at)                                               \
    do {                                                                                           \
        int32_t next_ = 0;                                                                         \
        for (uint32_t i_ = 0; i_ < (count); i_++)                                                  \
            if (!(items)[i_] is_removed_at) (numbers)[i_] = next_++;                               \
    } while (0)

static bool number_objects(struct bd_gltf_writer *writer)
{
    const struct bd_scene *scene = writer->scene;
    const struct bd_scene_counts *n = &writer->slots;
    struct bd_gltf_numbers *numbers = &writer->numbers;
    *numbers = (struct bd_gltf_numbers){.materials = no_numbers(n->materials),
                                        .textures = no_numbers(n->textures),
                                        .pictures = no_numbers(n->pictures),
                                        .lights = no_numbers(n->lights),
                                        .cameras = no_numbers(n->cameras),
                                        .meshes = no_numbers(n->meshes),
                                        .nodes = no_numbers(n->nodes)};
    if (!numbers->materials || !numbers->textures || !numbers->pictures || !numbers->lights ||
        !numbers->cameras || !numbers->meshes || !numbers->nodes)
        return false;
    NUMBER(numbers->materials, scene->materials, n->materials, .is_removed);
    NUMBER(numbers->textures, scene->textures, n->textures, .is_removed);
    NUMBER(numbers->lights, scene->lights, n->lights, .is_removed);
    NUMBER(numbers->cameras, scene->cameras, n->cameras, .is_removed);
    NUMBER(numbers->nodes, scene->nodes, n->nodes, .is_removed);
    writer->node_count = bd_scene_count(scene).nodes;
    return true;
}

static bool add_material(struct bd_gltf_writer *writer, const struct bd_material *material)
{
    if (writer->material_count == writer->material_room) {
        uint32_t room = 2 * writer->material_room + 16;
        struct bd_material *longer = realloc(writer->materials, room * sizeof *longer);
        if (!longer) return false;
        writer->materials = longer;
        writer->material_room = room;
    }
    writer->materials[writer->material_count++] = *material;
    return true;
}

bool bd_gltf_plan(struct bd_gltf_writer *writer)
{
    const struct bd_scene *scene = writer->scene;
    writer->slots = bd_scene_slots(scene);
    const uint32_t count = writer->slots.materials;
    writer->variants = malloc((count + (size_t)1) * sizeof *writer->variants);
    if (!writer->variants || !number_objects(writer)) return false;
    for (uint32_t i = 0; i < count; i++) {
        for (int lacks = 0; lacks < BD_GLTF_LACKS_END; lacks++)
            writer->variants[i][lacks] = BD_NONE;
        writer->variants[i][0] = writer->numbers.materials[i];
        if (!scene->materials[i].is_removed && !add_material(writer, &scene->materials[i]))
            return false;
    }
    return true;
}

// --- maps that do not show ------------------------------------------------------------------

static unsigned lacks_of_map(const struct bd_primitive *primitive, const struct bd_texture_ref *ref)
{
    if (ref->texture == BD_NONE || primitive->uv[ref->uv_set]) return 0;
    return ref->uv_set == 0 ? BD_GLTF_LACKS_UV0 : BD_GLTF_LACKS_UV1;
}

static unsigned lacks_of(const struct bd_primitive *primitive, const struct bd_material *material)
{
    unsigned lacks = 0;
    const struct bd_texture_ref *map;
    for (uint32_t n = 0; (map = bd_material_map(material, n)); n++)
        lacks |= lacks_of_map(primitive, map);
    if (material->normal_map.texture != BD_NONE && !primitive->tangent)
        lacks |= BD_GLTF_LACKS_TANGENTS;
    return lacks;
}

static bool has_set(unsigned lacks, const struct bd_texture_ref *ref)
{
    return !(lacks & (ref->uv_set == 0 ? BD_GLTF_LACKS_UV0 : BD_GLTF_LACKS_UV1));
}

static struct bd_material without_maps(const struct bd_material *material, unsigned lacks)
{
    struct bd_material out = *material;
    struct bd_texture_ref *map;
    for (uint32_t n = 0; (map = bd_material_map(&out, n)); n++)
        if (map->texture != BD_NONE && !has_set(lacks, map)) *map = bd_texture_ref_none;
    if (lacks & BD_GLTF_LACKS_TANGENTS) out.normal_map = bd_texture_ref_none;
    return out;
}

int32_t bd_gltf_plan_material(struct bd_gltf_writer *writer, const struct bd_primitive *primitive)
{
    const struct bd_material *material = &writer->scene->materials[primitive->material];
    const unsigned lacks = lacks_of(primitive, material);
    int32_t *number = &writer->variants[primitive->material][lacks];
    if (*number != BD_NONE) return *number;
    const struct bd_material variant = without_maps(material, lacks);
    if (!add_material(writer, &variant)) return BD_NONE;
    writer->left_out.split_materials++;
    return *number = (int32_t)writer->material_count - 1;
}

// --- pictures -------------------------------------------------------------------------------

static void mark_shown(const struct bd_gltf_writer *writer, const struct bd_texture_ref *ref)
{
    if (ref->texture == BD_NONE) return;
    int32_t picture = writer->scene->textures[ref->texture].picture;
    if (picture != BD_NONE) writer->numbers.pictures[picture] = 0;
}

// As gltf_pictures.c: what no material shows is not decoded, and so it is not written.
void bd_gltf_plan_pictures(struct bd_gltf_writer *writer)
{
    int32_t *numbers = writer->numbers.pictures, next = 0;
    for (uint32_t i = 0; i < writer->material_count; i++) {
        const struct bd_texture_ref *map;
        for (uint32_t n = 0; (map = bd_material_map(&writer->materials[i], n)); n++)
            mark_shown(writer, map);
    }
    for (uint32_t i = 0; i < writer->slots.pictures; i++) {
        if (numbers[i] != BD_NONE)
            numbers[i] = next++;
        else
            writer->left_out.unshown_pictures += !writer->scene->pictures[i]->is_removed;
    }
}

void bd_gltf_plan_free(struct bd_gltf_writer *writer)
{
    struct bd_gltf_numbers *numbers = &writer->numbers;
    free(numbers->materials);
    free(numbers->textures);
    free(numbers->pictures);
    free(numbers->lights);
    free(numbers->cameras);
    free(numbers->meshes);
    free(numbers->nodes);
    free(writer->materials);
    free(writer->variants);
}
