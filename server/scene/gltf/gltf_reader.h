// What the files gltf_*.c share while they turn one document into one scene. Private to them.
//
// Order: check (references, bounds) -> materials, pictures -> nodes -> meshes. After the check
// every index in the document is BD_NONE or valid, every accessor lies inside its buffer, and the
// nodes form a forest; the later steps rely on it.

#ifndef BD_SCENE_GLTF_GLTF_READER_H
#define BD_SCENE_GLTF_GLTF_READER_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/gltf/gltf_shim.h"
#include "scene/gltf/import_input.h"
#include "scene/gltf/picture_queue.h"
#include "scene/mesh/mesh.h"
#include "scene/model/scene.h"

// What was repaired or left out; each that is not zero becomes a flag.
struct bd_gltf_repairs {
    struct bd_mesh_repairs mesh;
    uint32_t clamped_factors, repaired_rotations, non_affine_matrices, repaired_cameras;
    uint32_t repaired_lights, skipped_primitives, missing_positions, missing_texcoords;
    uint32_t uv_sets_ignored, odd_skin_weights, incomplete_triangles, nonfinite_texcoords;
    uint32_t normals_against_winding;
};

// Which TEXCOORD_n a material's two sets of coordinates are.
struct bd_gltf_uv_slots {
    uint32_t set[2];
};

struct bd_gltf_reader {
    const struct bd_gltf_document *doc;
    const struct bd_import_file *files;
    uint32_t file_count;
    const struct bd_import_limits *limits;
    struct bd_picture_queue *pictures; // of the scene, in its order
    struct bd_scene *scene;
    struct bd_err_detail *detail;
    struct bd_gltf_repairs repairs;
    uint64_t input_bytes;              // of all files
    uint64_t vertex_bytes_left;        // of limits->scene_bytes
    struct bd_gltf_uv_slots *uv_slots; // by material of the scene
};

// A JSON path for an error: bd_gltf_path("meshes[%u].weights", i).text
struct bd_gltf_path {
    char text[128];
};
struct bd_gltf_path bd_gltf_path(const char *format, ...) BD_PRINTF(1, 2);

// gltf_check.c
BD_MUST_CHECK
enum bd_err bd_gltf_check(struct bd_gltf_reader *reader);
uint32_t bd_gltf_component_bytes(uint32_t component_type); // 0 if there is no such type
uint32_t bd_gltf_element_bytes(const struct bd_gltf_accessor *accessor);
uint32_t bd_gltf_stride_bytes(const struct bd_gltf_reader *reader,
                              const struct bd_gltf_accessor *accessor);

// gltf_accessor.c. Both refuse a sparse index that is out of range.
//
// Elements `pick[0 .. pick_count)` of the accessor as floats, tightly packed, integers normalised
// if the accessor says so. `width` components an element are written; missing ones are left as
// they are, so fill the output with defaults first.
BD_MUST_CHECK
enum bd_err bd_gltf_read_floats(struct bd_gltf_reader *reader, int32_t accessor,
                                const uint32_t *pick, uint32_t pick_count, uint32_t width,
                                float *out);
// A whole accessor of unsigned scalars.
BD_MUST_CHECK
enum bd_err bd_gltf_read_indices(struct bd_gltf_reader *reader, int32_t accessor, uint32_t *out);
// The accessor that an attribute names, or BD_NONE.
int32_t bd_gltf_attribute(const struct bd_gltf_attributes *attributes, const char *name);

// gltf_materials.c, gltf_pictures.c, gltf_nodes.c, gltf_environment.c
BD_MUST_CHECK
enum bd_err bd_gltf_read_materials(struct bd_gltf_reader *reader);
BD_MUST_CHECK
enum bd_err bd_gltf_read_pictures(struct bd_gltf_reader *reader);
BD_MUST_CHECK
enum bd_err bd_gltf_read_nodes(struct bd_gltf_reader *reader);
BD_MUST_CHECK
enum bd_err bd_gltf_read_environment(struct bd_gltf_reader *reader);

// gltf_meshes.c: every mesh; a node that skins or morphs gets a baked mesh of its own.
BD_MUST_CHECK
enum bd_err bd_gltf_read_meshes(struct bd_gltf_reader *reader);

// gltf_triangles.c: the triangles of a primitive, expanded from strips, fans or no indices at all,
// as indices into its accessors. `*index` is the caller's to free.
BD_MUST_CHECK
enum bd_err bd_gltf_read_triangles(struct bd_gltf_reader *reader, const char *path,
                                   const struct bd_gltf_primitive *primitive, uint32_t vertex_count,
                                   uint32_t **index, uint32_t *index_count);

// gltf_deform.c: morph targets, then the skin, on the picked vertices of a primitive.
struct bd_gltf_deform {
    uint32_t weight_count;
    const double *weights;
    uint32_t joint_count; // 0 = no skin
    bd_dmat4 *world_from_bind;
};
BD_MUST_CHECK
enum bd_err bd_gltf_deform(struct bd_gltf_reader *reader, const struct bd_gltf_deform *deform,
                           const struct bd_gltf_primitive *in, const uint32_t *pick,
                           struct bd_primitive *out);

// gltf_uv.c: the matrix (scene.h) of a KHR_texture_transform; identity where no float holds a
// number.
void bd_gltf_uv_matrix(const double offset[2], double rotation, const double scale[2], float m[6]);

void bd_gltf_copy_name(char name[64], const char *text);
enum bd_err bd_gltf_no_memory(struct bd_gltf_reader *reader, const char *path);

#endif
