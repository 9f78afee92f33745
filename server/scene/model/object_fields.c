// The table of objects' fields, and what can be said of a field by its row alone.

#include "scene/model/object_fields.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "scene/model/scene.h"

// --- which fields an object has -----------------------------------------------------------------

static bool is_spot(const void *light)
{
    return ((const struct bd_light *)light)->kind == BD_LIGHT_SPOT;
}

static bool is_orthographic(const void *camera)
{
    return ((const struct bd_camera *)camera)->orthographic;
}

static bool is_perspective(const void *camera)
{
    return !is_orthographic(camera);
}

// --- the table ----------------------------------------------------------------------------------

static const char *const alpha_modes[] = {"opaque", "mask", "blend", NULL};
static const char *const wraps[] = {"repeat", "clamp", "mirror", NULL};
static const char *const light_kinds[] = {"directional", "point", "spot", NULL};

#define IN(type, member) .offset = offsetof(struct type, member)
#define LIGHT_MAX        1e30

static const struct bd_object_field material_rows[] = {
    {"name", BD_FIELD_NAME, IN(bd_material, name), .help = "for people"},
    {"base_color", BD_FIELD_NUMBERS, IN(bd_material, base_color), .count = 4, .most = 1,
     .standard = 1, .aspects = BD_ASPECT_BIT(COLOUR),
     .gltf = "pbrMetallicRoughness.baseColorFactor", .help = "linear RGBA"},
    {"metallic", BD_FIELD_NUMBERS, IN(bd_material, metallic), .count = 1, .most = 1, .standard = 1,
     .aspects = BD_ASPECT_BIT(METALNESS), .gltf = "pbrMetallicRoughness.metallicFactor",
     .help = "0: dielectric, 1: metal"},
    {"roughness", BD_FIELD_NUMBERS, IN(bd_material, roughness), .count = 1, .most = 1,
     .standard = 1, .aspects = BD_ASPECT_BIT(ROUGHNESS),
     .gltf = "pbrMetallicRoughness.roughnessFactor", .help = "its square is the lobe's width"},
    {"emissive", BD_FIELD_NUMBERS, IN(bd_material, emissive), .count = 3, .most = LIGHT_MAX,
     .aspects = BD_ASPECT_BIT(EMISSION), .gltf = "emissiveFactor",
     .gltf_scale = "extensions.KHR_materials_emissive_strength.emissiveStrength",
     .help = "linear RGB, cd/m^2"},
    {"normal_scale", BD_FIELD_NUMBERS, IN(bd_material, normal_scale), .count = 1, .least = -1e6,
     .most = 1e6, .standard = 1, .aspects = BD_ASPECT_BIT(NORMALS), .gltf = "normalTexture.scale",
     .help = "of the normal map's x and y"},
    {"ior", BD_FIELD_NUMBERS, IN(bd_material, ior), .count = 1, .least = 1, .most = 1e6,
     .or_zero = true, .standard = 1.5, .aspects = BD_ASPECT_BIT(ROUGHNESS) | BD_ASPECT_BIT(MEDIUM),
     .gltf = "extensions.KHR_materials_ior.ior",
     .help = "index of refraction; 0: reflects as a mirror does"},
    {"transmission", BD_FIELD_NUMBERS, IN(bd_material, transmission), .count = 1, .most = 1,
     .aspects = BD_ASPECT_BIT(MEDIUM),
     .gltf = "extensions.KHR_materials_transmission.transmissionFactor",
     .help = "share of the light that is not reflected"},
    {"thickness", BD_FIELD_NUMBERS, IN(bd_material, thickness_m), .count = 1,
     .most = BD_COORDINATE_MAX_M, .aspects = BD_ASPECT_BIT(MEDIUM),
     .gltf = "extensions.KHR_materials_volume.thicknessFactor", .help = "metres; 0: a thin wall"},
    {"attenuation_distance", BD_FIELD_NUMBERS, IN(bd_material, attenuation_distance_m), .count = 1,
     .most = FLT_MAX, .or_none = true, .standard = INFINITY, .aspects = BD_ASPECT_BIT(MEDIUM),
     .gltf = "extensions.KHR_materials_volume.attenuationDistance", .help = "metres; 0: clear"},
    {"attenuation_color", BD_FIELD_NUMBERS, IN(bd_material, attenuation_color), .count = 3,
     .most = 1, .standard = 1, .aspects = BD_ASPECT_BIT(MEDIUM),
     .gltf = "extensions.KHR_materials_volume.attenuationColor",
     .help = "what is left after that distance, linear RGB"},
    {"alpha_mode", BD_FIELD_WORD, IN(bd_material, alpha_mode), .words = alpha_modes,
     .gltf = "alphaMode", .help = "which parts of the surface are there"},
    {"alpha_cutoff", BD_FIELD_NUMBERS, IN(bd_material, alpha_cutoff), .count = 1, .most = 1e6,
     .standard = .5, .gltf = "alphaCutoff", .help = "of a mask: what has less alpha is not there"},
    {"double_sided", BD_FIELD_SWITCH, IN(bd_material, double_sided),
     .aspects = BD_ASPECT_BIT(SIDES), .gltf = "doubleSided", .help = "seen from behind, too"},
    {"unlit", BD_FIELD_SWITCH, IN(bd_material, unlit),
     .aspects = BD_ASPECT_BIT(SIDES) | BD_ASPECT_BIT(EMISSION),
     .gltf = "extensions.KHR_materials_unlit",
     .help = "shows its base colour, whatever light falls on it"},
    {"base_color_texture", BD_FIELD_MAP, IN(bd_material, base_color_map),
     .refers_to = BD_OBJECT_TEXTURE, .aspects = BD_ASPECT_BIT(COLOUR),
     .gltf = "pbrMetallicRoughness.baseColorTexture", .help = "sRGB, alpha in A"},
    {"metallic_roughness_texture", BD_FIELD_MAP, IN(bd_material, metallic_roughness_map),
     .refers_to = BD_OBJECT_TEXTURE, .aspects = BD_ASPECT_BIT(METALNESS) | BD_ASPECT_BIT(ROUGHNESS),
     .gltf = "pbrMetallicRoughness.metallicRoughnessTexture", .help = "G roughness, B metallic"},
    {"normal_texture", BD_FIELD_MAP, IN(bd_material, normal_map), .refers_to = BD_OBJECT_TEXTURE,
     .aspects = BD_ASPECT_BIT(NORMALS), .gltf = "normalTexture",
     .help = "in tangent space; shows where a mesh has tangents"},
    {"emissive_texture", BD_FIELD_MAP, IN(bd_material, emissive_map),
     .refers_to = BD_OBJECT_TEXTURE, .aspects = BD_ASPECT_BIT(EMISSION), .gltf = "emissiveTexture",
     .help = "sRGB"},
    {"transmission_texture", BD_FIELD_MAP, IN(bd_material, transmission_map),
     .refers_to = BD_OBJECT_TEXTURE, .aspects = BD_ASPECT_BIT(MEDIUM),
     .gltf = "extensions.KHR_materials_transmission.transmissionTexture", .help = "in R"},
};

static const struct bd_object_field texture_rows[] = {
    {"blob", BD_FIELD_HEAVY, .help = "a PNG or JPEG picture"},
    {"wrap_s", BD_FIELD_WORD, IN(bd_texture, wrap_s), .words = wraps, .help = "beyond its sides"},
    {"wrap_t", BD_FIELD_WORD, IN(bd_texture, wrap_t), .words = wraps,
     .help = "beyond top and bottom"},
    {"nearest", BD_FIELD_SWITCH, IN(bd_texture, nearest),
     .help = "magnified without interpolation"},
};

static const struct bd_object_field light_rows[] = {
    {"name", BD_FIELD_NAME, IN(bd_light, name), .help = "for people"},
    {"kind", BD_FIELD_WORD, IN(bd_light, kind), .words = light_kinds, .standard = BD_LIGHT_POINT,
     .aspects = BD_ASPECT_BIT(LIGHTS), .help = "shines along -z of the node that holds it"},
    {"color", BD_FIELD_NUMBERS, IN(bd_light, color), .count = 3, .most = LIGHT_MAX, .standard = 1,
     .aspects = BD_ASPECT_BIT(LIGHTS), .help = "linear RGB"},
    {"intensity", BD_FIELD_NUMBERS, IN(bd_light, intensity), .count = 1, .most = LIGHT_MAX,
     .standard = 1, .aspects = BD_ASPECT_BIT(LIGHTS),
     .help = "cd for point and spot, lux for directional"},
    {"range", BD_FIELD_NUMBERS, IN(bd_light, range_m), .count = 1, .most = BD_COORDINATE_MAX_M,
     .or_none = true, .standard = INFINITY, .aspects = BD_ASPECT_BIT(LIGHTS),
     .help = "metres; 0: unlimited"},
    {"cone_outer", BD_FIELD_NUMBERS, IN(bd_light, cone_outer), .count = 1, .least = 1e-4,
     .most = (double)1.57079637f, .standard = 0.78539816, .holds = is_spot,
     .aspects = BD_ASPECT_BIT(LIGHTS), .help = "half-angle of a spot, radians"},
    {"cone_inner", BD_FIELD_NUMBERS, IN(bd_light, cone_inner), .count = 1,
     .most = (double)1.57079637f, .holds = is_spot, .aspects = BD_ASPECT_BIT(LIGHTS),
     .help = "below cone_outer: where the light begins to fade"},
};

static const struct bd_object_field camera_rows[] = {
    {"name", BD_FIELD_NAME, IN(bd_camera, name), .help = "frames can ask for it by this"},
    {"orthographic", BD_FIELD_SWITCH, IN(bd_camera, orthographic),
     .aspects = BD_ASPECT_BIT(CAMERAS), .help = "looks along -z of the node that holds it"},
    {"yfov", BD_FIELD_NUMBERS, IN(bd_camera, yfov), .count = 1, .least = 1e-3,
     .most = (double)3.1101767f, // .99 pi
     .standard = 0.78539816, .holds = is_perspective, .aspects = BD_ASPECT_BIT(CAMERAS),
     .help = "whole vertical angle, radians"},
    {"xmag", BD_FIELD_NUMBERS, IN(bd_camera, xmag), .count = 1, .least = 1e-9,
     .most = BD_COORDINATE_MAX_M, .holds = is_orthographic, .aspects = BD_ASPECT_BIT(CAMERAS),
     .help = "half the width, metres"},
    {"ymag", BD_FIELD_NUMBERS, IN(bd_camera, ymag), .count = 1, .least = 1e-9,
     .most = BD_COORDINATE_MAX_M, .holds = is_orthographic, .aspects = BD_ASPECT_BIT(CAMERAS),
     .help = "half the height, metres"},
    {"near", BD_FIELD_NUMBERS, IN(bd_camera, near_m), .count = 1, .most = BD_COORDINATE_MAX_M,
     .standard = 0.01, .aspects = BD_ASPECT_BIT(CAMERAS),
     .help = "metres; with a perspective above 0"},
    {"far", BD_FIELD_NUMBERS, IN(bd_camera, far_m), .count = 1, .most = BD_COORDINATE_MAX_M,
     .or_none = true, .standard = INFINITY, .aspects = BD_ASPECT_BIT(CAMERAS),
     .help = "metres, beyond near; 0: none"},
};

static const struct bd_object_field mesh_rows[] = {
    {"name", BD_FIELD_NAME, IN(bd_mesh, name), .help = "for people"},
    {"primitives", BD_FIELD_HEAVY, .help = "lists of triangles; in set_mesh all of them anew"},
};

static const struct bd_object_field node_rows[] = {
    {"name", BD_FIELD_NAME, IN(bd_node, name), .help = "frames can ask for its camera by this"},
    {"parent", BD_FIELD_OBJECT, IN(bd_node, parent), .refers_to = BD_OBJECT_NODE,
     .help = "-1: a root of the scene"},
    {"mesh", BD_FIELD_OBJECT, IN(bd_node, mesh), .refers_to = BD_OBJECT_MESH, .help = "shown"},
    {"camera", BD_FIELD_OBJECT, IN(bd_node, camera), .refers_to = BD_OBJECT_CAMERA,
     .help = "placed"},
    {"light", BD_FIELD_OBJECT, IN(bd_node, light), .refers_to = BD_OBJECT_LIGHT, .help = "placed"},
    {"transform", BD_FIELD_HEAVY,
     .help = "parent_from_node: translation, rotation (x y z w) and scale, or a matrix of 16, "
             "column-major"},
    {"shown", BD_FIELD_SWITCH, IN(bd_node, is_hidden), .inverted = true, .standard = 1,
     .help = "with all that is below it"},
};

static const struct bd_object_field environment_rows[] = {
    {"radiance", BD_FIELD_NUMBERS, IN(bd_environment, radiance), .count = 3, .most = LIGHT_MAX,
     .help = "linear RGB, cd/m^2; of a map, a factor on it"},
    {"rotation", BD_FIELD_NUMBERS, IN(bd_environment, rotation), .count = 4,
     .least = -BD_COORDINATE_MAX_M, .most = BD_COORDINATE_MAX_M,
     .help = "of the map: quaternion x y z w, of any length; alone, it turns what is there"},
    {"map", BD_FIELD_HEAVY, .help = "an EXR or .hdr picture: the whole sphere, zenith on top"},
};

#define LIST(rows)                                                                                 \
    {                                                                                              \
        rows, sizeof rows / sizeof *rows                                                           \
    }

static const struct {
    const char *name;
    struct bd_object_field_list fields;
} kinds[BD_OBJECT_KIND_COUNT] = {
    [BD_OBJECT_PICTURE] = {"picture", {NULL, 0}},
    [BD_OBJECT_TEXTURE] = {"texture", LIST(texture_rows)},
    [BD_OBJECT_MATERIAL] = {"material", LIST(material_rows)},
    [BD_OBJECT_LIGHT] = {"light", LIST(light_rows)},
    [BD_OBJECT_CAMERA] = {"camera", LIST(camera_rows)},
    [BD_OBJECT_MESH] = {"mesh", LIST(mesh_rows)},
    [BD_OBJECT_NODE] = {"node", LIST(node_rows)},
    [BD_OBJECT_ENVIRONMENT] = {"environment", LIST(environment_rows)},
};

const char *bd_object_kind_name(enum bd_object_kind kind)
{
    return kinds[kind].name;
}

struct bd_object_field_list bd_object_fields(enum bd_object_kind kind)
{
    return kinds[kind].fields;
}

const struct bd_object_field *bd_object_field(enum bd_object_kind kind, const char *name)
{
    const struct bd_object_field_list list = kinds[kind].fields;
    for (uint32_t i = 0; i < list.count; i++)
        if (strcmp(list.rows[i].name, name) == 0) return &list.rows[i];
    return NULL;
}

const struct bd_object_field *bd_material_map_row(uint32_t n)
{
    for (size_t i = 0; i < sizeof material_rows / sizeof *material_rows; i++)
        if (material_rows[i].type == BD_FIELD_MAP && n-- == 0) return &material_rows[i];
    return NULL;
}

struct bd_texture_ref *bd_material_map(const struct bd_material *material, uint32_t n)
{
    const struct bd_object_field *row = bd_material_map_row(n);
    return row ? bd_field_of(row, material) : NULL;
}

// --- one field ----------------------------------------------------------------------------------

void *bd_field_of(const struct bd_object_field *row, const void *object)
{
    return (char *)object + row->offset;
}

size_t bd_field_bytes(const struct bd_object_field *row)
{
    switch (row->type) {
    case BD_FIELD_NAME:
        return sizeof((struct bd_material *)0)->name;
    case BD_FIELD_SWITCH:
        return sizeof(bool);
    case BD_FIELD_NUMBERS:
        return row->count * sizeof(float);
    case BD_FIELD_WORD:
        return sizeof(int);
    case BD_FIELD_OBJECT:
        return sizeof(int32_t);
    case BD_FIELD_MAP:
        return sizeof(struct bd_texture_ref);
    case BD_FIELD_HEAVY:
        break;
    }
    return 0;
}

bool bd_field_holds(const struct bd_object_field *row, const void *object)
{
    return !row->holds || row->holds(object);
}

bool bd_field_takes(const struct bd_object_field *row, double value)
{
    if (value == 0 && (row->or_zero || row->or_none)) return true;
    return isfinite(value) && (float)value >= (float)row->least && (float)value <= (float)row->most;
}

float bd_field_kept(const struct bd_object_field *row, double value)
{
    return row->or_none && value == 0 ? INFINITY : (float)value;
}

float bd_field_clamped(const struct bd_object_field *row, double value, uint32_t *clamped)
{
    if (row->or_none && !(value > 0 && value <= row->most)) return INFINITY;
    if (bd_field_takes(row, value)) return (float)value;
    ++*clamped;
    return (float)(value > row->most ? row->most : row->least);
}

double bd_field_said(const struct bd_object_field *row, float value)
{
    return row->or_none && isinf(value) ? 0 : (double)value;
}

// A range that ends far out is there against nonsense; one that ends near is what formulas rely on.
void bd_field_stored_range(const struct bd_object_field *row, float *least, float *most)
{
    *least = row->least < 0 ? -FLT_MAX : 0;
    *most = row->or_none ? INFINITY : row->most < 1e5 ? (float)row->most : FLT_MAX;
}

const struct bd_texture_ref bd_texture_ref_none = {BD_NONE, 0, {1, 0, 0, 0, 1, 0}};

static void set_standard(const struct bd_object_field *row, void *at)
{
    float *numbers = at;
    const int word = row->type == BD_FIELD_WORD ? (int)row->standard : 0;
    const int32_t none = BD_NONE;
    switch (row->type) {
    case BD_FIELD_NAME:
        memset(at, 0, bd_field_bytes(row));
        break;
    case BD_FIELD_SWITCH:
        *(bool *)at = (row->standard != 0) != row->inverted;
        break;
    case BD_FIELD_NUMBERS:
        for (uint32_t i = 0; i < row->count; i++) numbers[i] = (float)row->standard;
        break;
    case BD_FIELD_WORD:
        memcpy(at, &word, sizeof word);
        break;
    case BD_FIELD_OBJECT:
        memcpy(at, &none, sizeof none);
        break;
    case BD_FIELD_MAP:
        *(struct bd_texture_ref *)at = bd_texture_ref_none;
        break;
    case BD_FIELD_HEAVY:
        break;
    }
}

void bd_object_set_standards(enum bd_object_kind kind, void *object)
{
    const struct bd_object_field_list list = kinds[kind].fields;
    for (uint32_t i = 0; i < list.count; i++)
        set_standard(&list.rows[i], bd_field_of(&list.rows[i], object));
}

// --- for a reader -------------------------------------------------------------------------------

static void list_words(const char *const *words, char *out)
{
    size_t used = 0;
    for (int i = 0; words[i]; i++)
        used += (size_t)snprintf(out + used, BD_FIELD_TAKES_BYTES - used, "%s%s",
                                 i == 0 ? "" : (words[i + 1] ? ", " : " or "), words[i]);
}

const char *bd_field_takes_text(const struct bd_object_field *row, char out[BD_FIELD_TAKES_BYTES])
{
    char count[24] = "a number";
    switch (row->type) {
    case BD_FIELD_NAME:
        snprintf(out, BD_FIELD_TAKES_BYTES, "text, up to %zu bytes", bd_field_bytes(row) - 1);
        break;
    case BD_FIELD_SWITCH:
        snprintf(out, BD_FIELD_TAKES_BYTES, "true or false");
        break;
    case BD_FIELD_NUMBERS:
        if (row->count > 1) snprintf(count, sizeof count, "%u numbers", row->count);
        snprintf(out, BD_FIELD_TAKES_BYTES, "%s from %.6g to %.6g%s", count, row->least, row->most,
                 row->or_zero || (row->or_none && row->least > 0) ? ", or 0" : "");
        break;
    case BD_FIELD_WORD:
        list_words(row->words, out);
        break;
    case BD_FIELD_OBJECT:
    case BD_FIELD_MAP:
        snprintf(out, BD_FIELD_TAKES_BYTES, "a %s's id, or -1", kinds[row->refers_to].name);
        break;
    case BD_FIELD_HEAVY:
        out[0] = '\0';
    }
    return out;
}
