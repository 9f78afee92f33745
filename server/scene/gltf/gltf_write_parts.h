// What the files gltf_write*.c share while they turn one snapshot into one document. Private to
// them.
//
// Order: plan (who is written, under which number) -> meshes (streams as the importer would have
// them) -> the parts of the document, which put what is large into views -> assembly. A missing
// piece of memory is remembered in `json` or answered by false; nothing else can fail before the
// assembly.

#ifndef BD_SCENE_GLTF_GLTF_WRITE_PARTS_H
#define BD_SCENE_GLTF_GLTF_WRITE_PARTS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/gltf/gltf_write_json.h"
#include "scene/model/scene.h"

// The extensions that a document may use, as bits of `extensions`: these, and behind them those of
// materials (bd_gltf_material_extension).
// X(NAME, name in the file)
#define BD_GLTF_EXTENSION_MAP(X)                                                                   \
    X(ENVIRONMENT, "BOUNCED_environment")                                                          \
    X(LIGHTS, "KHR_lights_punctual")                                                               \
    X(VISIBILITY, "KHR_node_visibility")                                                           \
    X(TEXTURE_TRANSFORM, "KHR_texture_transform")

enum bd_gltf_extension {
#define X(name, text) BD_GLTF_EXTENSION_##name,
    BD_GLTF_EXTENSION_MAP(X)
#undef X
        BD_GLTF_EXTENSION_COUNT
};

// What a primitive may lack of what its material's maps need; then those maps do not show on it.
enum {
    BD_GLTF_LACKS_UV0 = 1,
    BD_GLTF_LACKS_UV1 = 2,
    BD_GLTF_LACKS_TANGENTS = 4,
    BD_GLTF_LACKS_END = 8,
};

// A stretch of the binary chunk: one accessor's elements, or one picture.
struct bd_gltf_out_view {
    const void *bytes;
    void *own; // to be freed; NULL: the bytes are the snapshot's, or a mesh's
    uint64_t size_bytes, offset_bytes;
    uint32_t target; // as GL calls it; 0: a picture
};

// In the order of the names that write_accessor has for them.
enum bd_gltf_out_type { BD_GLTF_OUT_SCALAR, BD_GLTF_OUT_VEC2, BD_GLTF_OUT_VEC3, BD_GLTF_OUT_VEC4 };

struct bd_gltf_out_accessor {
    uint32_t view; // all of it
    uint32_t count;
    uint32_t component_type; // as GL calls it
    enum bd_gltf_out_type type;
    bool has_bounds; // of positions, as the specification wants
    float least[3], most[3];
};

enum bd_gltf_stream {
    BD_GLTF_STREAM_POSITION,
    BD_GLTF_STREAM_NORMAL,
    BD_GLTF_STREAM_TANGENT,
    BD_GLTF_STREAM_UV0,
    BD_GLTF_STREAM_UV1,
    BD_GLTF_STREAM_COLOR,
    BD_GLTF_STREAM_INDEX,
    BD_GLTF_STREAM_COUNT
};

// A mesh as the importer would make it of the file.
struct bd_gltf_out_mesh {
    struct bd_mesh mesh; // a shell: primitives of its own, with the numbers of written materials
    bool *owns_streams;  // of each primitive; else they are the snapshot's
    int32_t same_as;     // among the written: the first with the same streams, or itself
    int32_t (*accessors)[BD_GLTF_STREAM_COUNT]; // of each primitive, BD_NONE where there is none
};

// A number under which each slot is written, BD_NONE for what is not.
struct bd_gltf_numbers {
    int32_t *materials, *textures, *pictures, *lights, *cameras, *meshes, *nodes;
};

struct bd_gltf_writer {
    const struct bd_scene *scene;
    struct bd_err_detail *detail;
    struct bd_scene_flags *notes;
    struct bd_scene_counts slots;   // of the scene
    struct bd_gltf_numbers numbers; // pictures: once the materials are known

    // Materials as they are written; texture numbers are still the scene's. Behind those of the
    // scene lie the variants for primitives that cannot show all maps.
    uint32_t material_count, material_room;
    struct bd_material *materials;
    int32_t (*variants)[BD_GLTF_LACKS_END]; // by slot and what is lacking; BD_NONE: none yet
    uint32_t mesh_count;
    struct bd_gltf_out_mesh *meshes;
    uint32_t node_count; // without the roots that meshes in world space get
    uint32_t view_count, view_room;
    struct bd_gltf_out_view *views;
    uint32_t accessor_count, accessor_room;
    struct bd_gltf_out_accessor *accessors;
    uint32_t extensions; // 1 << their numbers: those in use
    struct bd_gltf_json json;
    struct {
        uint32_t empty_meshes, empty_primitives, degenerate_triangles, unread_tangents;
        uint32_t split_materials, unshown_pictures, world_space_meshes;
        uint64_t unused_vertices;
    } left_out;
};

// gltf_write.c: begins the extension's object within the "extensions" of something, and notes its
// use.
void bd_gltf_open_extension(struct bd_gltf_writer *writer, uint32_t extension);

// gltf_write_plan.c. False only without memory.
BD_MUST_CHECK
bool bd_gltf_plan(struct bd_gltf_writer *writer);
// The number of the material that a primitive is written with: its own, without the maps that the
// primitive cannot show. BD_NONE only without memory.
int32_t bd_gltf_plan_material(struct bd_gltf_writer *writer, const struct bd_primitive *primitive);
// Numbers the pictures that a written material shows.
void bd_gltf_plan_pictures(struct bd_gltf_writer *writer);
void bd_gltf_plan_free(struct bd_gltf_writer *writer);

// gltf_write_settle.c. False only without memory.
BD_MUST_CHECK
bool bd_gltf_settle_meshes(struct bd_gltf_writer *writer);
void bd_gltf_free_meshes(struct bd_gltf_writer *writer);

// gltf_write_meshes.c. False only without memory.
BD_MUST_CHECK
bool bd_gltf_write_meshes(struct bd_gltf_writer *writer);

// gltf_write_materials.c, gltf_write_textures.c, gltf_write_nodes.c, gltf_write_lights.c
void bd_gltf_write_materials(struct bd_gltf_writer *writer);
BD_MUST_CHECK
enum bd_err bd_gltf_write_textures(struct bd_gltf_writer *writer); // pictures and samplers too
void bd_gltf_write_nodes(struct bd_gltf_writer *writer);           // and the scene
void bd_gltf_write_cameras(struct bd_gltf_writer *writer);
// Within the document's extensions; the latter of gltf_environment.c.
void bd_gltf_write_lights(struct bd_gltf_writer *writer);
void bd_gltf_write_environment(struct bd_gltf_writer *writer);
bool bd_gltf_has_environment(const struct bd_scene *scene);

// gltf_uv.c: what KHR_texture_transform gives `m` again, to the last bit where it came of
// such a transform.
struct bd_gltf_uv_transform {
    double offset[2], rotation, scale[2];
};
struct bd_gltf_uv_transform bd_gltf_uv_transform_of(const float m[6]);

// gltf_write_views.c: appends a view and says its number; BD_NONE, and `own` is freed, without
// memory.
int32_t bd_gltf_add_view(struct bd_gltf_writer *writer, const struct bd_gltf_out_view *view);
// An accessor of a view of its own.
int32_t bd_gltf_add_accessor(struct bd_gltf_writer *writer,
                             const struct bd_gltf_out_accessor *accessor,
                             const struct bd_gltf_out_view *view);
void bd_gltf_write_views(struct bd_gltf_writer *writer); // accessors, views and the buffer
uint64_t bd_gltf_views_bytes(const struct bd_gltf_writer *writer); // of all, each padded to 4
void bd_gltf_copy_views(const struct bd_gltf_writer *writer, uint8_t *out);
void bd_gltf_free_views(struct bd_gltf_writer *writer);

#endif
