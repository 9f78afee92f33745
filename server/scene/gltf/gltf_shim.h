// tinygltf behind plain C: the parsed document as arrays of structs.
//
// The shim only parses and copies numbers. Nothing in it is checked against anything else: every
// index may be out of range, every count a lie. gltf_check.c checks; the rest of gltf_*.c may then
// rely on it. Give it only JSON that gltf_scan.c has passed: tinygltf recurses over nesting.
//
// Thread: any; runs in the import child.

#ifndef BD_SCENE_GLTF_GLTF_SHIM_H
#define BD_SCENE_GLTF_GLTF_SHIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/gltf/import_input.h"

#ifdef __cplusplus
extern "C" {
#endif

// Indices are int32_t with -1 (BD_NONE) for "absent"; texts are never NULL. Everything lives as
// long as the document.

struct bd_gltf_buffer {
    const uint8_t *bytes;
    uint64_t size_bytes;
};

struct bd_gltf_view {
    int32_t buffer;
    uint64_t offset_bytes, length_bytes;
    uint32_t stride_bytes; // 0 = tightly packed
};

struct bd_gltf_accessor {
    int32_t view;
    uint64_t offset_bytes, count;
    uint32_t component_type;          // 5120 ... 5126
    uint32_t row_count, column_count; // MAT3: 3, 3; VEC3: 3, 1; SCALAR: 1, 1
    bool normalized;
    bool is_sparse;
    int64_t sparse_count;
    int32_t sparse_index_view, sparse_value_view;
    int64_t sparse_index_offset_bytes, sparse_value_offset_bytes;
    uint32_t sparse_index_type;
};

struct bd_gltf_attribute {
    const char *name; // POSITION, TEXCOORD_0, ...
    int32_t accessor;
};

struct bd_gltf_attributes {
    uint32_t count;
    const struct bd_gltf_attribute *items;
};

struct bd_gltf_primitive {
    struct bd_gltf_attributes attributes;
    uint32_t target_count;
    const struct bd_gltf_attributes *targets;
    int32_t indices, material;
    int32_t mode; // 0 points ... 4 triangles, 5 strip, 6 fan
};

struct bd_gltf_mesh {
    const char *name;
    uint32_t primitive_count;
    const struct bd_gltf_primitive *primitives;
    uint32_t weight_count;
    const double *weights;
};

struct bd_gltf_node {
    const char *name;
    int32_t mesh, skin, camera, light;
    bool is_hidden; // KHR_node_visibility
    uint32_t child_count;
    const int32_t *children;
    bool has_matrix;
    double matrix[16]; // column-major
    double translation[3], rotation[4], scale[3];
    uint32_t weight_count;
    const double *weights;
};

struct bd_gltf_skin {
    uint32_t joint_count;
    const int32_t *joints;
    int32_t inverse_bind_matrices;
};

struct bd_gltf_scene {
    uint32_t node_count;
    const int32_t *nodes;
};

struct bd_gltf_texture_info {
    int32_t texture;
    int32_t uv_set; // KHR_texture_transform's own, if it has one
    double offset[2], rotation, scale[2];
};

struct bd_gltf_texture {
    int32_t sampler, source;
};

struct bd_gltf_sampler {
    int32_t mag_filter, wrap_s, wrap_t; // GL names; mag_filter -1 = unsaid
};

struct bd_gltf_image {
    int32_t view;           // or
    const char *uri;        // percent-encoded as in the file, or
    const uint8_t *encoded; // out of a data uri
    uint64_t encoded_bytes;
};

struct bd_gltf_light {
    const char *name, *type;
    double color[3], intensity, range; // 0 = unlimited
    double cone_inner, cone_outer;
};

struct bd_gltf_camera {
    const char *name;
    bool orthographic;
    double yfov, xmag, ymag, near, far; // perspective far 0 = none
};

struct bd_gltf_environment_map {
    int32_t accessor, width, height;
};

struct bd_gltf_environment { // gltf_environment.c
    bool is_there, has_map;
    double radiance[3], rotation[4]; // all 0: none
    struct bd_gltf_environment_map map;
};

struct bd_gltf_document {
    uint32_t buffer_count, view_count, accessor_count, mesh_count, node_count, skin_count;
    uint32_t scene_count, material_count, texture_count, sampler_count, image_count;
    uint32_t light_count, camera_count, extension_used_count;
    int32_t default_scene;
    struct bd_gltf_buffer *buffers;
    struct bd_gltf_view *views;
    struct bd_gltf_accessor *accessors;
    struct bd_gltf_mesh *meshes;
    struct bd_gltf_node *nodes;
    struct bd_gltf_skin *skins;
    struct bd_gltf_scene *scenes;
    struct bd_gltf_texture *textures;
    struct bd_gltf_sampler *samplers;
    struct bd_gltf_image *images;
    struct bd_gltf_light *lights;
    struct bd_gltf_camera *cameras;
    struct bd_gltf_environment environment;
    const char **extensions_used;
};

// Of material `i`, what lies at a path, "pbrMetallicRoughness.metallicFactor". Numbers that the file
// does not say keep their values; an extension without more is on where it is there.
const char *bd_gltf_material_name(const struct bd_gltf_document *document, uint32_t i);
void bd_gltf_material_numbers(const struct bd_gltf_document *document, uint32_t i, const char *path,
                              uint32_t count, double *out);
bool bd_gltf_material_switch(const struct bd_gltf_document *document, uint32_t i, const char *path);
const char *bd_gltf_material_text(const struct bd_gltf_document *document, uint32_t i,
                                  const char *path); // "": nothing
struct bd_gltf_texture_info bd_gltf_material_map(const struct bd_gltf_document *document,
                                                 uint32_t i, const char *path);

// The file that a percent-encoded uri of the document means, or NULL: an entry of `files` whose
// uri is the same text before or after percent-decoding. Never a path that anyone opens.
const struct bd_import_file *bd_gltf_find_file(const struct bd_import_file *files,
                                               uint32_t file_count, const char *uri);

// Parses the .gltf or .glb in `bytes`. Buffers and images answer from `files` alone, and all
// answers together are limited to a few times the files' own size: a document may name one file
// many times, and tinygltf keeps a copy of each. Nothing is thrown past this: what tinygltf
// refuses is BD_ERR_BAD_INPUT with its words, missing memory BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_gltf_parse(const uint8_t *bytes, size_t size, bool is_glb,
                          const struct bd_import_file *files, uint32_t file_count,
                          struct bd_gltf_document **out, struct bd_err_detail *detail);
void bd_gltf_document_destroy(struct bd_gltf_document **document);

#ifdef __cplusplus
}
#endif

#endif
