// Materials: what glTF takes for granted is left out.

#include <math.h>
#include <string.h>

#include "scene/gltf_write_parts.h"

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

// `scale` is that of a normal map, 1 otherwise.
static void write_map(struct bd_gltf_writer *writer, const char *key,
                      const struct bd_texture_ref *ref, float scale)
{
    struct bd_gltf_json *json = &writer->json;
    if (ref->texture == BD_NONE) return;
    bd_gltf_json_open(json, key, '{');
    bd_gltf_json_uint(json, "index", (uint64_t)writer->numbers.textures[ref->texture]);
    if (ref->uv_set) bd_gltf_json_uint(json, "texCoord", ref->uv_set);
    if (scale != 1) bd_gltf_json_f32(json, "scale", scale);
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
    const float strength_max = 1e30f; // the importer's
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

// --- the rest -------------------------------------------------------------------------------

static void write_pbr(struct bd_gltf_writer *writer, const struct bd_material *material)
{
    struct bd_gltf_json *json = &writer->json;
    const float *color = material->base_color;
    bd_gltf_json_open(json, "pbrMetallicRoughness", '{');
    if (color[0] != 1 || color[1] != 1 || color[2] != 1 || color[3] != 1)
        bd_gltf_json_f32s(json, "baseColorFactor", color, 4);
    write_map(writer, "baseColorTexture", &material->base_color_map, 1);
    if (material->metallic != 1) bd_gltf_json_f32(json, "metallicFactor", material->metallic);
    if (material->roughness != 1) bd_gltf_json_f32(json, "roughnessFactor", material->roughness);
    write_map(writer, "metallicRoughnessTexture", &material->metallic_roughness_map, 1);
    bd_gltf_json_close(json, '{');
}

static void write_alpha(struct bd_gltf_json *json, const struct bd_material *material)
{
    static const char *const modes[] = {"OPAQUE", "MASK", "BLEND"};
    const bool has_cutoff = material->alpha_cutoff != 0.5f;
    if (material->alpha_mode != BD_ALPHA_OPAQUE || has_cutoff)
        bd_gltf_json_text(json, "alphaMode", modes[material->alpha_mode]);
    if (has_cutoff) bd_gltf_json_f32(json, "alphaCutoff", material->alpha_cutoff);
}

static void write_transmission(struct bd_gltf_writer *writer, const struct bd_material *material)
{
    struct bd_gltf_json *json = &writer->json;
    if (material->transmission == 0 && material->transmission_map.texture == BD_NONE) return;
    bd_gltf_open_extension(writer, BD_GLTF_EXTENSION_TRANSMISSION);
    bd_gltf_json_f32(json, "transmissionFactor", material->transmission);
    write_map(writer, "transmissionTexture", &material->transmission_map, 1);
    bd_gltf_json_close(json, '{');
}

static void write_volume(struct bd_gltf_writer *writer, const struct bd_material *material)
{
    struct bd_gltf_json *json = &writer->json;
    const float *color = material->attenuation_color;
    const bool is_white = color[0] == 1 && color[1] == 1 && color[2] == 1;
    const bool is_clear = !isfinite(material->attenuation_distance_m);
    if (material->thickness_m == 0 && is_clear && is_white) return;
    bd_gltf_open_extension(writer, BD_GLTF_EXTENSION_VOLUME);
    bd_gltf_json_f32(json, "thicknessFactor", material->thickness_m);
    if (!is_clear) bd_gltf_json_f32(json, "attenuationDistance", material->attenuation_distance_m);
    if (!is_white) bd_gltf_json_f32s(json, "attenuationColor", color, 3);
    bd_gltf_json_close(json, '{');
}

static bool has_extensions(const struct bd_material *material, float strength)
{
    const float *color = material->attenuation_color;
    return strength != 1 || material->ior != 1.5f || material->transmission != 0 ||
           material->transmission_map.texture != BD_NONE || material->thickness_m != 0 ||
           isfinite(material->attenuation_distance_m) || color[0] != 1 || color[1] != 1 ||
           color[2] != 1 || material->unlit;
}

static void write_extensions(struct bd_gltf_writer *writer, const struct bd_material *material,
                             float strength)
{
    struct bd_gltf_json *json = &writer->json;
    if (!has_extensions(material, strength)) return;
    bd_gltf_json_open(json, "extensions", '{');
    if (strength != 1) {
        bd_gltf_open_extension(writer, BD_GLTF_EXTENSION_EMISSIVE_STRENGTH);
        bd_gltf_json_f32(json, "emissiveStrength", strength);
        bd_gltf_json_close(json, '{');
    }
    if (material->ior != 1.5f) {
        bd_gltf_open_extension(writer, BD_GLTF_EXTENSION_IOR);
        bd_gltf_json_f32(json, "ior", material->ior);
        bd_gltf_json_close(json, '{');
    }
    write_transmission(writer, material);
    write_volume(writer, material);
    if (material->unlit) {
        bd_gltf_open_extension(writer, BD_GLTF_EXTENSION_UNLIT);
        bd_gltf_json_close(json, '{');
    }
    bd_gltf_json_close(json, '{');
}

static void write_material(struct bd_gltf_writer *writer, const struct bd_material *material)
{
    struct bd_gltf_json *json = &writer->json;
    float factor[3];
    const float strength = strength_of(material->emissive, factor);
    bd_gltf_json_open(json, NULL, '{');
    if (material->name[0]) bd_gltf_json_text(json, "name", material->name);
    write_pbr(writer, material);
    write_map(writer, "normalTexture", &material->normal_map, material->normal_scale);
    write_map(writer, "emissiveTexture", &material->emissive_map, 1);
    if (factor[0] != 0 || factor[1] != 0 || factor[2] != 0)
        bd_gltf_json_f32s(json, "emissiveFactor", factor, 3);
    write_alpha(json, material);
    if (material->double_sided) bd_gltf_json_bool(json, "doubleSided", true);
    write_extensions(writer, material, strength);
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
