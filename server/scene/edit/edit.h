// Edits: the operations of a batch, checked against a snapshot and turned into a delta (delta.h).
//
// The operations are those of EditOp (protocol/bounced.proto), in C: text decoded to enums, heavy
// payloads prepared (decoded, checked, sealed) by whoever calls, off the event loop. Ids are
// objects' slots; BD_NONE is none; BD_EDIT_ADDED(k) is what operation k of the same batch adds.
//
// A batch is checked wholly: one error, and nothing is changed. Values out of range are refused,
// never clamped. The error's field is the wire's path: "ops[3].set_light.intensity".
//
// Thread: any. Time is that of the small objects and the operations, and of `steps` of the limits.

#ifndef BD_SCENE_EDIT_EDIT_H
#define BD_SCENE_EDIT_EDIT_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/edit/edit_kinds.h"
#include "scene/model/delta.h"
#include "scene/model/scene.h"

#define BD_EDIT_ADDED(op) (-2 - (int32_t)(op))

// A field that is given, by the name of its row (object_fields.h); which of the rest is read is
// said by the row's type.
struct bd_field_value {
    const char *name;
    const char *text;      // names, words
    const double *numbers; // as many as the row has, or it is refused
    size_t count;
    int32_t whole; // ids; 0 or 1
};

enum {
    BD_GIVEN_TRANSLATION = 1u << 0,
    BD_GIVEN_ROTATION = 1u << 1,
    BD_GIVEN_SCALE = 1u << 2,
    BD_GIVEN_MATRIX = 1u << 3,
};

// Either the matrix or any of the others; none of them is no movement.
struct bd_transform_edit {
    bool is_given; // in set_node: or it stays as it is
    uint32_t given;
    double translation[3], rotation[4], scale[3];
    double matrix[16]; // column-major, affine
};

// Of add_mesh, set_mesh, set_mesh_vertices. `mesh` is sealed; its primitives' materials are ids as
// in the operations, BD_NONE being a white one (not read of set_mesh_vertices, where the mesh keeps
// its name and materials, and has to have as many vertices and triangles as before).
struct bd_mesh_edit {
    const char *name;     // NULL: keeps it
    struct bd_mesh *mesh; // NULL in set_mesh: keeps it
};

struct bd_environment_edit {
    bool keeps_light; // radiance and map stay as they are
    double radiance[3];
    double rotation[4];     // all 0: none
    struct bd_sky_map *map; // sealed, or NULL
};

// What the scene shows becomes children of a new node. Nodes that it does not show stay behind.
struct bd_import_edit {
    int32_t parent;
    const char *name;             // NULL: none
    const struct bd_scene *scene; // finished
};

// Everything is borrowed for the call.
//
// `fields` are those of a node, a material, a texture, a light or a camera. What is not given keeps
// its value, or in an add_ gets its standard. What an object has not (the cone of a point light) is
// not kept. A map that is new to a material reads the first set of texture coordinates,
// untransformed.
struct bd_edit_op {
    enum bd_edit_kind kind;
    int32_t id; // of set_ and remove_
    const struct bd_field_value *fields;
    size_t field_count;
    union {
        struct bd_transform_edit transform; // of nodes, and of set_transform
        struct bd_mesh_edit mesh;
        struct bd_picture *picture; // of textures: sealed; NULL in set_texture: keeps it
        struct bd_environment_edit environment;
        struct bd_import_edit import;
    };
};

struct bd_edit_limits {
    uint32_t ops;       // of one batch
    uint32_t objects;   // slots of each kind, empty ones too; at most BD_OBJECT_ID_END
    uint64_t triangles; // of all nodes' meshes
    uint32_t steps;     // from nodes up to their parents, where a batch removes nodes or moves them
};
extern const struct bd_edit_limits bd_edit_default_limits;

// On success `*out` is the caller's to finish, and `ids` (one of each operation; may be NULL) are
// those of what was added, else BD_NONE; of an import that of the new node.
//   BD_ERR_USAGE: a value out of its range, parents in a loop, a reference to a later operation.
//   BD_ERR_NOT_FOUND: a reference to what is not there, or was removed.
//   BD_ERR_CONFLICT: a removal of what is used still; the message names by whom.
//   BD_ERR_LIMIT, BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_edit_check(const struct bd_scene *base, const struct bd_edit_op *ops,
                          uint32_t op_count, const struct bd_edit_limits *limits,
                          struct bd_delta *out, int32_t *ids, struct bd_err_detail *detail);

// Triangles as a client sends them. Streams are borrowed; only positions have to be there.
struct bd_primitive_source {
    int32_t material; // as in the operations; BD_NONE: a white one
    uint32_t vertex_count, index_count;
    const float *positions, *normals, *tangents; // 3, 3 and 4 a vertex
    const float *uv[2], *colors;                 // 2 and 4
    const uint32_t *indices;                     // NULL: each three vertices are a triangle
};

// For add_mesh and set_mesh, off the event loop: a sealed mesh. Normals that are not given are
// smooth over shared vertices, which stay as many as were sent; tangents are made wherever there is
// uv0. Triangles without area go. Faults name `field`, "ops[0].add_mesh", and the stream in it. The
// caller owns the result.
BD_MUST_CHECK
enum bd_err bd_edit_build_mesh(const struct bd_primitive_source *primitives, uint32_t count,
                               const char *field, struct bd_mesh **out,
                               struct bd_err_detail *detail);

// For set_mesh_vertices, off the event loop: a sealed mesh of the same triangles whose primitive
// `primitive` has its vertices elsewhere. `normals` may be NULL: made anew from the triangles,
// smooth where they were. Tangents turn with their normals. Faults name `field`, which
// is the path of the operation: "ops[0].set_mesh_vertices". The caller owns the result.
BD_MUST_CHECK
enum bd_err bd_edit_deform_mesh(const struct bd_mesh *mesh, uint32_t primitive,
                                const float *positions, const float *normals, uint32_t vertex_count,
                                const char *field, struct bd_mesh **out,
                                struct bd_err_detail *detail);

#endif
