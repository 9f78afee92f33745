// The kinds of operations that an edit has: a row each, in the order of the schema's EditOp.
//
// Thread: any; all data is constant.

#ifndef BD_SCENE_EDIT_EDIT_KINDS_H
#define BD_SCENE_EDIT_EDIT_KINDS_H

#include "scene/model/object_fields.h"

// X(NAME, name on the wire, kind of object, what it does to it, help)
#define BD_EDIT_MAP(X)                                                                             \
    X(ADD_NODE, add_node, NODE, ADDS, "shown, and a root of the scene, unless said otherwise")     \
    X(SET_NODE, set_node, NODE, SETS, "what is given; the transform as a whole")                   \
    X(REMOVE_NODE, remove_node, NODE, REMOVES, "and all that is below it")                         \
    X(SET_TRANSFORM, set_transform, NODE, SETS,                                                    \
      "translation, rotation and scale, or matrix; what is left out is no movement")               \
    X(ADD_MESH, add_mesh, MESH, ADDS, "of one primitive or more; a node shows it")                 \
    X(SET_MESH, set_mesh, MESH, SETS, "all primitives anew, or its name alone")                    \
    X(REMOVE_MESH, remove_mesh, MESH, REMOVES, "refused while a node shows it")                    \
    X(SET_MESH_VERTICES, set_mesh_vertices, MESH, SETS,                                            \
      "new places for the vertices of one primitive, as many as it has")                           \
    X(ADD_MATERIAL, add_material, MATERIAL, ADDS, "")                                              \
    X(SET_MATERIAL, set_material, MATERIAL, SETS, "")                                              \
    X(REMOVE_MATERIAL, remove_material, MATERIAL, REMOVES, "refused while a mesh shows it")        \
    X(ADD_TEXTURE, add_texture, TEXTURE, ADDS, "")                                                 \
    X(SET_TEXTURE, set_texture, TEXTURE, SETS, "")                                                 \
    X(REMOVE_TEXTURE, remove_texture, TEXTURE, REMOVES, "refused while a material shows it")       \
    X(ADD_LIGHT, add_light, LIGHT, ADDS, "a node places it")                                       \
    X(SET_LIGHT, set_light, LIGHT, SETS, "")                                                       \
    X(REMOVE_LIGHT, remove_light, LIGHT, REMOVES, "refused while a node places it")                \
    X(ADD_CAMERA, add_camera, CAMERA, ADDS, "a node places it")                                    \
    X(SET_CAMERA, set_camera, CAMERA, SETS, "")                                                    \
    X(REMOVE_CAMERA, remove_camera, CAMERA, REMOVES, "refused while a node places it")             \
    X(SET_ENVIRONMENT, set_environment, ENVIRONMENT, SETS, "")                                     \
    X(IMPORT, import, NODE, ADDS,                                                                  \
      "the default scene of a glTF file (blob, files), as children of a new node under parent")

enum bd_edit_kind {
#define X(name, wire, object, does, help) BD_EDIT_##name,
    BD_EDIT_MAP(X)
#undef X
        BD_EDIT_KIND_COUNT
};

enum bd_edit_does { BD_EDIT_ADDS, BD_EDIT_SETS, BD_EDIT_REMOVES };

struct bd_edit_kind_row {
    const char *name; // "set_light"
    enum bd_object_kind object;
    enum bd_edit_does does;
    const char *help;
};
extern const struct bd_edit_kind_row bd_edit_kinds[BD_EDIT_KIND_COUNT];

#endif
