// Materials: what glTF takes for granted is left out.

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "scene/gltf/gltf_schema.h"
#include "scene/gltf/gltf_write_parts.h"
#include "scene/model/object_fields.h"

// A material as it is written, with its emission apart.
struct written {
    const struct bd_material *material;
    struct bd_material standard; // what glTF takes for granted
    float factor[3], strength;
};

static bool has_standard(const struct bd_object_field *row, const struct written *of)
{
    const void *at = bd_field_of(row, of->material);
    if (row->type == BD_FIELD_MAP) return ((const struct bd_texture_ref *)at)->texture == BD_NONE;
    return memcmp(at, bd_field_of(row, &of->standard), bd_field_bytes(row)) == 0;
}

// --- maps -----------------------------------------------------------------------------------

static bool is_identity(const float m[6])
{
    return m[0] == 1 && m[1] == 0 && m[2] == 0 && m[3] == 0 && m[4] == 1 && m[5] == 0;
}

static void write_transform(struct bd_gltf_writer *writer, const float m[6])
{
    struct bd_gltf_json *json = &writer->json;
    const struct bd_gltf_uv_transform transform = bd_gltf_uv_transform_of(m);
    bd_gltf_json_open(json, "extensions", '{');
    bd_gltf_open_extension(writer, BD_GLTF_EXTENSION_TEXTURE_TRANSFORM);
    bd_gltf_json_f64s(json, "offset", transform.offset, 2);
    if (transform.rotation != 0) bd_gltf_json_f64(json, "rotation", transform.rotation);
    bd_gltf_json_f64s(json, "scale", transform.scale, 2);
    bd_gltf_json_close(json, '{');
    bd_gltf_json_close(json, '{');
}

// Of what lies in the map itself: the scale of a normal map.
static void write_inner_numbers(struct bd_gltf_writer *writer, const char *path,
                                const struct written *of)
{
    const struct bd_object_field_list list = bd_object_fields(BD_OBJECT_MATERIAL);
    const size_t bytes = strlen(path);
    for (uint32_t i = 0; i < list.count; i++) {
        const struct bd_object_field *row = &list.rows[i];
        const bool is_inside =
            row->gltf && strncmp(row->gltf, path, bytes) == 0 && row->gltf[bytes] == '.';
        if (is_inside && !has_standard(row, of))
            bd_gltf_json_f32(&writer->json, row->gltf + bytes + 1,
                             *(const float *)bd_field_of(row, of->material));
    }
}

static void write_map(struct bd_gltf_writer *writer, const char *key, const char *path,
                      const struct bd_texture_ref *ref, const struct written *of)
{
    struct bd_gltf_json *json = &writer->json;
    bd_gltf_json_open(json, key, '{');
    bd_gltf_json_uint(json, "index", (uint64_t)writer->numbers.textures[ref->texture]);
    if (ref->uv_set) bd_gltf_json_uint(json, "texCoord", ref->uv_set);
    write_inner_numbers(writer, path, of);
    if (!is_identity(ref->uv_transform)) write_transform(writer, ref->uv_transform);
    bd_gltf_json_close(json, '{');
}

// --- emission -------------------------------------------------------------------------------

// Factors whose products with the strength are the emission again, to the last bit. False if there
// are none.
static bool split_emission(const float emissive[3], float strength, float factor[3])
{
    for (int i = 0; i < 3; i++) {
        float guess = emissive[i] / strength;
        const float near[] = {guess, nextafterf(guess, 0), nextafterf(guess, 1)};
        size_t k = 0;
        while (k < 3 && !(near[k] <= 1 && near[k] * strength == emissive[i])) k++;
        if (k == 3) return false;
        factor[i] = near[k];
    }
    return true;
}

// The strength that most files have, that of the brightest channel; where its factors do not come
// out even, a power of two, with which they always do.
static float strength_of(const float emissive[3], float factor[3])
{
    const float strength_max = (float)bd_object_field(BD_OBJECT_MATERIAL, "emissive")->most;
    float most = fmaxf(emissive[0], fmaxf(emissive[1], emissive[2]));
    memcpy(factor, emissive, 3 * sizeof *factor);
    if (most <= 1 || split_emission(emissive, most, factor)) return most <= 1 ? 1 : most;
    int exponent;
    frexpf(most, &exponent);
    float even = ldexpf(1, exponent);
    if (even <= strength_max && split_emission(emissive, even, factor)) return even;
    for (int i = 0; i < 3; i++) factor[i] = fminf(emissive[i] / most, 1);
    return most;
}

// --- rows -----------------------------------------------------------------------------------

static void write_word(struct bd_gltf_json *json, const char *key, const char *word)
{
    char text[32] = "";
    for (size_t i = 0; word[i] && i + 1 < sizeof text; i++) text[i] = (char)toupper(word[i]);
    bd_gltf_json_text(json, key, text);
}

static void write_field(struct bd_gltf_writer *writer, const struct bd_object_field *row,
                        const char *key, const struct written *of)
{
    struct bd_gltf_json *json = &writer->json;
    const void *at = row->gltf_scale ? of->factor : bd_field_of(row, of->material);
    int word;
    switch (row->type) {
    case BD_FIELD_NUMBERS:
        if (row->count == 1) bd_gltf_json_f32(json, key, *(const float *)at);
        if (row->count > 1) bd_gltf_json_f32s(json, key, at, (int)row->count);
        break;
    case BD_FIELD_SWITCH:
        bd_gltf_json_bool(json, key, true);
        break;
    case BD_FIELD_WORD:
        memcpy(&word, at, sizeof word);
        write_word(json, key, row->words[word]);
        break;
    case BD_FIELD_MAP:
        write_map(writer, key, row->gltf, at, of);
        break;
    case BD_FIELD_NAME:
    case BD_FIELD_OBJECT:
    case BD_FIELD_HEAVY:
        break;
    }
}

// The last part of a path that lies in the object which `place` names ("pbrMetallicRoughness.");
// NULL: it does not, or further in.
static const char *key_in(const char *path, const char *place)
{
    const size_t bytes = strlen(place);
    if (!path || strncmp(path, place, bytes) != 0 || strchr(path + bytes, '.')) return NULL;
    return path + bytes;
}

// Whether an object has to be there, or is written. An extension's name alone is a switch.
static bool visit_place(struct bd_gltf_writer *writer, const char *place, const struct written *of,
                        bool writes)
{
    const struct bd_object_field_list list = bd_object_fields(BD_OBJECT_MATERIAL);
    bool any = false;
    for (uint32_t i = 0; i < list.count; i++) {
        const struct bd_object_field *row = &list.rows[i];
        const char *key = key_in(row->gltf, place), *scale = key_in(row->gltf_scale, place);
        const bool is_told = key && !has_standard(row, of);
        const bool has_scale = scale && of->strength != 1;
        any |= is_told || has_scale;
        if (writes && is_told) write_field(writer, row, key, of);
        if (writes && has_scale) bd_gltf_json_f32(&writer->json, scale, of->strength);
    }
    return any;
}

static bool is_switched_on(const char *extension, const struct written *of)
{
    const struct bd_object_field_list list = bd_object_fields(BD_OBJECT_MATERIAL);
    for (uint32_t i = 0; i < list.count; i++)
        if (list.rows[i].type == BD_FIELD_SWITCH && key_in(list.rows[i].gltf, "extensions.") &&
            strcmp(key_in(list.rows[i].gltf, "extensions."), extension) == 0)
            return !has_standard(&list.rows[i], of);
    return false;
}

static void write_extensions(struct bd_gltf_writer *writer, const struct written *of)
{
    struct bd_gltf_json *json = &writer->json;
    const char *name;
    bool is_open = false;
    for (uint32_t i = 0; (name = bd_gltf_material_extension(i)); i++) {
        char place[64];
        snprintf(place, sizeof place, "extensions.%s.", name);
        if (!visit_place(writer, place, of, false) && !is_switched_on(name, of)) continue;
        if (!is_open) bd_gltf_json_open(json, "extensions", '{');
        is_open = true;
        bd_gltf_open_extension(writer, BD_GLTF_EXTENSION_COUNT + i);
        visit_place(writer, place, of, true);
        bd_gltf_json_close(json, '{');
    }
    if (is_open) bd_gltf_json_close(json, '{');
}

static void write_material(struct bd_gltf_writer *writer, const struct bd_material *material)
{
    struct bd_gltf_json *json = &writer->json;
    struct written of = {.material = material};
    bd_object_set_standards(BD_OBJECT_MATERIAL, &of.standard);
    of.strength = strength_of(material->emissive, of.factor);
    bd_gltf_json_open(json, NULL, '{');
    if (material->name[0]) bd_gltf_json_text(json, "name", material->name);
    bd_gltf_json_open(json, "pbrMetallicRoughness", '{');
    visit_place(writer, "pbrMetallicRoughness.", &of, true);
    bd_gltf_json_close(json, '{');
    visit_place(writer, "", &of, true);
    write_extensions(writer, &of);
    bd_gltf_json_close(json, '{');
}

void bd_gltf_write_materials(struct bd_gltf_writer *writer)
{
    if (!writer->material_count) return;
    bd_gltf_json_open(&writer->json, "materials", '[');
    for (uint32_t i = 0; i < writer->material_count; i++)
        write_material(writer, &writer->materials[i]);
    bd_gltf_json_close(&writer->json, '[');
}
