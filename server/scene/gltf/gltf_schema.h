// What we read of glTF, as a table: for each kind of object its properties, their types, and which
// must be there. A property that is not in the table is not read by anyone here.
//
// Thread: any; all data is constant.

#ifndef BD_SCENE_GLTF_GLTF_SCHEMA_H
#define BD_SCENE_GLTF_GLTF_SCHEMA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum bd_gltf_type {
    BD_GLTF_UNREAD, // any value; taken out before the parser sees it
    BD_GLTF_BOOL,
    BD_GLTF_UINT,   // 0 ... 2^53
    BD_GLTF_LENGTH, // 1 ... 2^53
    BD_GLTF_STRIDE, // 4, 8 ... 252
    BD_GLTF_INDEX,  // 0 ... 2^31 - 1
    BD_GLTF_NUMBER,
    BD_GLTF_STRING,
    BD_GLTF_CHOICE,         // a string out of `choices`
    BD_GLTF_VERSION,        // "2.x"
    BD_GLTF_MIN_VERSION,    // "2.0"
    BD_GLTF_EXTENSION_NAME, // of an extension that must be supported
    BD_GLTF_OBJECT,
};

enum bd_gltf_object {
    BD_GLTF_ROOT,
    BD_GLTF_ASSET,
    BD_GLTF_BUFFER,
    BD_GLTF_VIEW,
    BD_GLTF_ACCESSOR,
    BD_GLTF_SPARSE,
    BD_GLTF_SPARSE_INDICES,
    BD_GLTF_SPARSE_VALUES,
    BD_GLTF_MESH,
    BD_GLTF_PRIMITIVE,
    BD_GLTF_ATTRIBUTES,
    BD_GLTF_NODE,
    BD_GLTF_NODE_EXTENSIONS,
    BD_GLTF_NODE_LIGHT,
    BD_GLTF_NODE_VISIBILITY,
    BD_GLTF_SKIN,
    BD_GLTF_SCENE,
    BD_GLTF_MATERIAL,
    BD_GLTF_PBR,
    BD_GLTF_TEXTURE_INFO,
    BD_GLTF_TEXTURE_INFO_EXTENSIONS,
    BD_GLTF_TEXTURE_TRANSFORM,
    BD_GLTF_MATERIAL_EXTENSIONS,
    BD_GLTF_MATERIAL_EXTENSION, // the first; as many more as rows of materials name
    BD_GLTF_MATERIAL_EXTENSION_LAST = BD_GLTF_MATERIAL_EXTENSION + 15,
    BD_GLTF_TEXTURE,
    BD_GLTF_SAMPLER,
    BD_GLTF_IMAGE,
    BD_GLTF_CAMERA,
    BD_GLTF_PERSPECTIVE,
    BD_GLTF_ORTHOGRAPHIC,
    BD_GLTF_ROOT_EXTENSIONS,
    BD_GLTF_LIGHTS,
    BD_GLTF_ENVIRONMENT,
    BD_GLTF_ENVIRONMENT_MAP,
    BD_GLTF_LIGHT,
    BD_GLTF_SPOT,
    BD_GLTF_OBJECT_COUNT,
};

struct bd_gltf_property {
    const char *key;
    enum bd_gltf_type type; // of the value, or of the array's elements
    bool is_array;
    uint8_t length;             // of the array; 0 = any
    enum bd_gltf_object object; // for BD_GLTF_OBJECT
    const char *choices;        // for BD_GLTF_CHOICE: "OPAQUE|MASK|BLEND"
    bool required;
};

struct bd_gltf_object_rule {
    const struct bd_gltf_property *properties;
    uint32_t property_count; // at most 32
    // Where any key is allowed, and each has this one type.
    const struct bd_gltf_property *any_key;
    // What the parser spends on one, about: its struct, its JSON value, and our copy.
    uint32_t cost_bytes;
};

const struct bd_gltf_object_rule *bd_gltf_rule(enum bd_gltf_object object);

// The property of that name (not terminated), or NULL.
const struct bd_gltf_property *bd_gltf_find_property(enum bd_gltf_object object, const char *key,
                                                     size_t key_bytes);

// The extensions that rows of materials lie in (object_fields.h), by number; NULL: no more.
const char *bd_gltf_material_extension(uint32_t number);
// Paths of maps that materials may have and nobody reads, up to a NULL.
extern const char *const bd_gltf_unread_maps[];

// True for the extensions that the importer reads.
bool bd_gltf_extension_is_supported(const char *name);

#endif
