// What we read of glTF, as a table.

#include "scene/gltf/gltf_schema.h"

#include <ctype.h>
#include <pthread.h>
#include <string.h>

#include "base/assert.h"
#include "scene/model/object_fields.h"

#define VALUE(name, kind)                                                                          \
    {                                                                                              \
        .key = name, .type = BD_GLTF_##kind                                                        \
    }
#define REQUIRED(name, kind)                                                                       \
    {                                                                                              \
        .key = name, .type = BD_GLTF_##kind, .required = true                                      \
    }
#define CHOICE(name, list)                                                                         \
    {                                                                                              \
        .key = name, .type = BD_GLTF_CHOICE, .choices = list                                       \
    }
#define ARRAY(name, kind, n)                                                                       \
    {                                                                                              \
        .key = name, .type = BD_GLTF_##kind, .is_array = true, .length = n                         \
    }
#define CHILD(name, what)                                                                          \
    {                                                                                              \
        .key = name, .type = BD_GLTF_OBJECT, .object = BD_GLTF_##what                              \
    }
#define CHILDREN(name, what)                                                                       \
    {                                                                                              \
        .key = name, .type = BD_GLTF_OBJECT, .object = BD_GLTF_##what, .is_array = true            \
    }

static const struct bd_gltf_property root[] = {
    {.key = "asset", .type = BD_GLTF_OBJECT, .object = BD_GLTF_ASSET, .required = true},
    ARRAY("extensionsUsed", STRING, 0),
    ARRAY("extensionsRequired", EXTENSION_NAME, 0),
    VALUE("scene", INDEX),
    CHILDREN("scenes", SCENE),
    CHILDREN("nodes", NODE),
    CHILDREN("meshes", MESH),
    CHILDREN("skins", SKIN),
    CHILDREN("materials", MATERIAL),
    CHILDREN("textures", TEXTURE),
    CHILDREN("samplers", SAMPLER),
    CHILDREN("images", IMAGE),
    CHILDREN("cameras", CAMERA),
    CHILDREN("accessors", ACCESSOR),
    CHILDREN("bufferViews", VIEW),
    CHILDREN("buffers", BUFFER),
    CHILD("extensions", ROOT_EXTENSIONS),
};

static const struct bd_gltf_property asset[] = {REQUIRED("version", VERSION),
                                                VALUE("minVersion", MIN_VERSION)};

static const struct bd_gltf_property buffer[] = {REQUIRED("byteLength", LENGTH),
                                                 VALUE("uri", STRING)};

static const struct bd_gltf_property view[] = {REQUIRED("buffer", INDEX), VALUE("byteOffset", UINT),
                                               REQUIRED("byteLength", UINT),
                                               VALUE("byteStride", STRIDE)};

static const struct bd_gltf_property accessor[] = {
    VALUE("bufferView", INDEX),
    VALUE("byteOffset", UINT),
    VALUE("normalized", BOOL),
    REQUIRED("componentType", INDEX),
    REQUIRED("count", UINT),
    {.key = "type",
     .type = BD_GLTF_CHOICE,
     .choices = "SCALAR|VEC2|VEC3|VEC4|MAT2|MAT3|MAT4",
     .required = true},
    CHILD("sparse", SPARSE),
};

static const struct bd_gltf_property sparse[] = {
    REQUIRED("count", INDEX),
    {.key = "indices", .type = BD_GLTF_OBJECT, .object = BD_GLTF_SPARSE_INDICES, .required = true},
    {.key = "values", .type = BD_GLTF_OBJECT, .object = BD_GLTF_SPARSE_VALUES, .required = true},
};

static const struct bd_gltf_property sparse_indices[] = {
    REQUIRED("bufferView", INDEX), VALUE("byteOffset", INDEX), REQUIRED("componentType", INDEX)};

static const struct bd_gltf_property sparse_values[] = {REQUIRED("bufferView", INDEX),
                                                        VALUE("byteOffset", INDEX)};

static const struct bd_gltf_property mesh[] = {
    VALUE("name", STRING),
    {.key = "primitives",
     .type = BD_GLTF_OBJECT,
     .object = BD_GLTF_PRIMITIVE,
     .is_array = true,
     .required = true},
    ARRAY("weights", NUMBER, 0),
};

static const struct bd_gltf_property primitive[] = {
    {.key = "attributes", .type = BD_GLTF_OBJECT, .object = BD_GLTF_ATTRIBUTES, .required = true},
    VALUE("indices", INDEX),
    VALUE("material", INDEX),
    VALUE("mode", INDEX),
    CHILDREN("targets", ATTRIBUTES),
};

static const struct bd_gltf_property attribute = VALUE("", INDEX);

static const struct bd_gltf_property node[] = {
    VALUE("name", STRING),
    VALUE("mesh", INDEX),
    VALUE("skin", INDEX),
    VALUE("camera", INDEX),
    ARRAY("children", INDEX, 0),
    ARRAY("matrix", NUMBER, 16),
    ARRAY("translation", NUMBER, 3),
    ARRAY("rotation", NUMBER, 4),
    ARRAY("scale", NUMBER, 3),
    ARRAY("weights", NUMBER, 0),
    CHILD("extensions", NODE_EXTENSIONS),
};

static const struct bd_gltf_property node_extensions[] = {
    CHILD("KHR_lights_punctual", NODE_LIGHT), CHILD("KHR_node_visibility", NODE_VISIBILITY)};

static const struct bd_gltf_property node_light[] = {REQUIRED("light", INDEX)};

static const struct bd_gltf_property node_visibility[] = {VALUE("visible", BOOL)};

static const struct bd_gltf_property skin[] = {
    VALUE("name", STRING),
    VALUE("inverseBindMatrices", INDEX),
    {.key = "joints", .type = BD_GLTF_INDEX, .is_array = true, .required = true},
};

static const struct bd_gltf_property scene[] = {VALUE("name", STRING), ARRAY("nodes", INDEX, 0)};

// Beside these, a material and what lies in it has the rows of its fields (object_fields.h).
static const struct bd_gltf_property material[] = {
    VALUE("name", STRING),
    CHILD("pbrMetallicRoughness", PBR),
    CHILD("extensions", MATERIAL_EXTENSIONS),
};

static const struct bd_gltf_property texture_info[] = {
    REQUIRED("index", INDEX), VALUE("texCoord", INDEX), VALUE("scale", NUMBER),
    VALUE("strength", NUMBER), CHILD("extensions", TEXTURE_INFO_EXTENSIONS)};

static const struct bd_gltf_property texture_info_extensions[] = {
    CHILD("KHR_texture_transform", TEXTURE_TRANSFORM)};

static const struct bd_gltf_property texture_transform[] = {
    ARRAY("offset", NUMBER, 2), VALUE("rotation", NUMBER), ARRAY("scale", NUMBER, 2),
    VALUE("texCoord", INDEX)};

static const struct bd_gltf_property texture[] = {VALUE("sampler", INDEX), VALUE("source", INDEX)};

static const struct bd_gltf_property sampler[] = {VALUE("magFilter", INDEX),
                                                  VALUE("minFilter", INDEX), VALUE("wrapS", INDEX),
                                                  VALUE("wrapT", INDEX)};

static const struct bd_gltf_property image[] = {VALUE("uri", STRING), VALUE("bufferView", INDEX),
                                                VALUE("mimeType", STRING)};

static const struct bd_gltf_property camera[] = {
    VALUE("name", STRING),
    {.key = "type",
     .type = BD_GLTF_CHOICE,
     .choices = "perspective|orthographic",
     .required = true},
    CHILD("perspective", PERSPECTIVE),
    CHILD("orthographic", ORTHOGRAPHIC),
};

static const struct bd_gltf_property perspective[] = {
    REQUIRED("yfov", NUMBER), REQUIRED("znear", NUMBER), VALUE("zfar", NUMBER)};

static const struct bd_gltf_property orthographic[] = {
    REQUIRED("xmag", NUMBER), REQUIRED("ymag", NUMBER), REQUIRED("znear", NUMBER),
    REQUIRED("zfar", NUMBER)};

static const struct bd_gltf_property root_extensions[] = {
    CHILD("KHR_lights_punctual", LIGHTS), CHILD("BOUNCED_environment", ENVIRONMENT)};

static const struct bd_gltf_property environment[] = {
    {.key = "radiance", .type = BD_GLTF_NUMBER, .is_array = true, .length = 3, .required = true},
    {.key = "rotation", .type = BD_GLTF_NUMBER, .is_array = true, .length = 4},
    CHILD("map", ENVIRONMENT_MAP),
};

static const struct bd_gltf_property environment_map[] = {
    REQUIRED("accessor", INDEX), REQUIRED("width", INDEX), REQUIRED("height", INDEX)};

static const struct bd_gltf_property lights[] = {
    {.key = "lights",
     .type = BD_GLTF_OBJECT,
     .object = BD_GLTF_LIGHT,
     .is_array = true,
     .required = true},
};

static const struct bd_gltf_property light[] = {
    VALUE("name", STRING),
    {.key = "type", .type = BD_GLTF_CHOICE, .choices = "directional|point|spot", .required = true},
    ARRAY("color", NUMBER, 3),
    VALUE("intensity", NUMBER),
    VALUE("range", NUMBER),
    CHILD("spot", SPOT),
};

static const struct bd_gltf_property spot[] = {VALUE("innerConeAngle", NUMBER),
                                               VALUE("outerConeAngle", NUMBER)};

#define RULE(table, cost)                                                                          \
    {                                                                                              \
        .properties = table, .property_count = sizeof table / sizeof table[0], .cost_bytes = cost  \
    }

// Completed once, before the first question. The costs are sizes measured with tinygltf 2.7.0,
// rounded up.
static struct bd_gltf_object_rule rules[BD_GLTF_OBJECT_COUNT] = {
    [BD_GLTF_ROOT] = RULE(root, 0),
    [BD_GLTF_ASSET] = RULE(asset, 0),
    [BD_GLTF_BUFFER] = RULE(buffer, 500),
    [BD_GLTF_VIEW] = RULE(view, 500),
    [BD_GLTF_ACCESSOR] = RULE(accessor, 700),
    [BD_GLTF_SPARSE] = RULE(sparse, 100),
    [BD_GLTF_SPARSE_INDICES] = RULE(sparse_indices, 100),
    [BD_GLTF_SPARSE_VALUES] = RULE(sparse_values, 100),
    [BD_GLTF_MESH] = RULE(mesh, 700),
    [BD_GLTF_PRIMITIVE] = RULE(primitive, 700),
    [BD_GLTF_ATTRIBUTES] = {.any_key = &attribute, .cost_bytes = 200},
    [BD_GLTF_NODE] = RULE(node, 1500),
    [BD_GLTF_NODE_EXTENSIONS] = RULE(node_extensions, 500),
    [BD_GLTF_NODE_LIGHT] = RULE(node_light, 500),
    [BD_GLTF_NODE_VISIBILITY] = RULE(node_visibility, 500),
    [BD_GLTF_SKIN] = RULE(skin, 500),
    [BD_GLTF_SCENE] = RULE(scene, 500),
    [BD_GLTF_MATERIAL] = RULE(material, 4000),
    [BD_GLTF_PBR] = {.cost_bytes = 500},
    [BD_GLTF_TEXTURE_INFO] = RULE(texture_info, 500),
    [BD_GLTF_TEXTURE_INFO_EXTENSIONS] = RULE(texture_info_extensions, 500),
    [BD_GLTF_TEXTURE_TRANSFORM] = RULE(texture_transform, 1000),
    [BD_GLTF_MATERIAL_EXTENSIONS] = {.cost_bytes = 500},
    [BD_GLTF_TEXTURE] = RULE(texture, 500),
    [BD_GLTF_SAMPLER] = RULE(sampler, 500),
    [BD_GLTF_IMAGE] = RULE(image, 700),
    [BD_GLTF_CAMERA] = RULE(camera, 1500),
    [BD_GLTF_PERSPECTIVE] = RULE(perspective, 100),
    [BD_GLTF_ORTHOGRAPHIC] = RULE(orthographic, 100),
    [BD_GLTF_ROOT_EXTENSIONS] = RULE(root_extensions, 500),
    [BD_GLTF_LIGHTS] = RULE(lights, 500),
    [BD_GLTF_ENVIRONMENT] = RULE(environment, 1000),
    [BD_GLTF_ENVIRONMENT_MAP] = RULE(environment_map, 500),
    [BD_GLTF_LIGHT] = RULE(light, 1500),
    [BD_GLTF_SPOT] = RULE(spot, 200),
};

// --- materials, by their rows -------------------------------------------------------------------

#define PROPERTIES_MAX  32
#define EXTENSIONS_MAX  (BD_GLTF_MATERIAL_EXTENSION_LAST - BD_GLTF_MATERIAL_EXTENSION + 1)
#define EXTENSION_BYTES 48
#define EXTENSION_COST  1000

const char *const bd_gltf_unread_maps[] = {
    "occlusionTexture", "extensions.KHR_materials_volume.thicknessTexture", NULL};

static struct bd_gltf_property completed[BD_GLTF_OBJECT_COUNT][PROPERTIES_MAX];
static char extensions[EXTENSIONS_MAX][EXTENSION_BYTES];
static uint32_t extension_count;
static char choices[256]; // of all rows, one behind the other
static size_t choices_used;

// "OPAQUE|MASK|BLEND"
static const char *choices_of(const char *const *words)
{
    char *begin = choices + choices_used;
    for (int i = 0; words[i]; i++) {
        for (const char *c = words[i]; *c; c++) choices[choices_used++] = (char)toupper(*c);
        choices[choices_used++] = words[i + 1] ? '|' : '\0';
        BD_ASSERT(choices_used < sizeof choices);
    }
    return begin;
}

static struct bd_gltf_property property_of(const struct bd_object_field *row, const char *key)
{
    struct bd_gltf_property out = {.key = key, .type = BD_GLTF_NUMBER};
    if (row->type == BD_FIELD_NUMBERS && row->count > 1) {
        out.is_array = true;
        out.length = (uint8_t)row->count;
    }
    if (row->type == BD_FIELD_SWITCH) out.type = BD_GLTF_BOOL;
    if (row->type == BD_FIELD_WORD) out.type = BD_GLTF_CHOICE, out.choices = choices_of(row->words);
    if (row->type == BD_FIELD_MAP) out.type = BD_GLTF_OBJECT, out.object = BD_GLTF_TEXTURE_INFO;
    return out;
}

static void add(enum bd_gltf_object object, struct bd_gltf_property property)
{
    struct bd_gltf_object_rule *rule = &rules[object];
    if (rule->properties != completed[object] && rule->property_count)
        memcpy(completed[object], rule->properties,
               rule->property_count * sizeof completed[object][0]);
    rule->properties = completed[object];
    BD_ASSERT(rule->property_count < PROPERTIES_MAX);
    completed[object][rule->property_count++] = property;
}

// The object of an extension, by its name up to a dot.
static enum bd_gltf_object extension_of(const char *name)
{
    const size_t bytes = strcspn(name, ".");
    uint32_t i = 0;
    while (i < extension_count &&
           !(strncmp(extensions[i], name, bytes) == 0 && extensions[i][bytes] == 0))
        i++;
    const enum bd_gltf_object object = (enum bd_gltf_object)(BD_GLTF_MATERIAL_EXTENSION + i);
    if (i < extension_count) return object;
    BD_ASSERT(i < EXTENSIONS_MAX && bytes < EXTENSION_BYTES);
    memcpy(extensions[extension_count++], name, bytes);
    rules[object].cost_bytes = EXTENSION_COST;
    add(BD_GLTF_MATERIAL_EXTENSIONS,
        (struct bd_gltf_property){.key = extensions[i], .type = BD_GLTF_OBJECT, .object = object});
    return object;
}

// Where a path leads further than that, it leads into a map, which has its own rule.
static void add_path(const struct bd_object_field *row, const char *path)
{
    static const char pbr[] = "pbrMetallicRoughness.", extension[] = "extensions.";
    enum bd_gltf_object object = BD_GLTF_MATERIAL;
    const char *key = path;
    if (strncmp(path, pbr, sizeof pbr - 1) == 0) {
        object = BD_GLTF_PBR;
        key += sizeof pbr - 1;
    } else if (strncmp(path, extension, sizeof extension - 1) == 0) {
        object = extension_of(path + sizeof extension - 1);
        key += sizeof extension - 1;
        key += strcspn(key, ".");
        if (!*key++) return; // a switch: the extension alone
    }
    if (!strchr(key, '.')) add(object, property_of(row, key));
}

static void complete(void)
{
    const struct bd_object_field_list list = bd_object_fields(BD_OBJECT_MATERIAL);
    const struct bd_object_field scale = {.type = BD_FIELD_NUMBERS, .count = 1};
    const struct bd_object_field map = {.type = BD_FIELD_MAP};
    for (uint32_t i = 0; i < list.count; i++) {
        if (list.rows[i].gltf) add_path(&list.rows[i], list.rows[i].gltf);
        if (list.rows[i].gltf_scale) add_path(&scale, list.rows[i].gltf_scale);
    }
    for (int i = 0; bd_gltf_unread_maps[i]; i++) add_path(&map, bd_gltf_unread_maps[i]);
}

static void complete_once(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, complete);
}

const struct bd_gltf_object_rule *bd_gltf_rule(enum bd_gltf_object object)
{
    complete_once();
    return &rules[object];
}

const struct bd_gltf_property *bd_gltf_find_property(enum bd_gltf_object object, const char *key,
                                                     size_t key_bytes)
{
    const struct bd_gltf_object_rule *rule = bd_gltf_rule(object);
    if (rule->any_key) return rule->any_key;
    for (uint32_t i = 0; i < rule->property_count; i++)
        if (strlen(rule->properties[i].key) == key_bytes &&
            memcmp(rule->properties[i].key, key, key_bytes) == 0)
            return &rule->properties[i];
    return NULL;
}

const char *bd_gltf_material_extension(uint32_t number)
{
    complete_once();
    return number < extension_count ? extensions[number] : NULL;
}

bool bd_gltf_extension_is_supported(const char *name)
{
    static const char *const others[] = {"KHR_lights_punctual", "KHR_texture_transform",
                                         "KHR_mesh_quantization", "KHR_node_visibility",
                                         "BOUNCED_environment"};
    const char *extension;
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++)
        if (strcmp(name, others[i]) == 0) return true;
    for (uint32_t i = 0; (extension = bd_gltf_material_extension(i)); i++)
        if (strcmp(name, extension) == 0) return true;
    return false;
}
