// A batch that is being checked. Only edit*.c include this.
//
// The draft is a copy of the snapshot on which the operations are carried out. The first error
// stays: whatever is asked after it has no effect, so that a chain of fields is checked once.

#ifndef BD_SCENE_EDIT_EDIT_PARTS_H
#define BD_SCENE_EDIT_EDIT_PARTS_H

#include "scene/edit/edit.h"

struct bd_edit_place {
    enum bd_object_kind kind;
    uint32_t id;
    uint32_t op; // that touched or removed it
};

struct bd_edit_list {
    uint32_t count, room;
    struct bd_edit_place *places;
};

struct bd_edit {
    struct bd_scene *draft;
    struct bd_scene_counts next; // the first slot of each kind that nothing had yet
    const struct bd_edit_op *ops;
    uint32_t op; // under way
    int32_t *ids;
    const struct bd_edit_limits *limits;
    struct bd_edit_list touched, removed;
    bool has_removed_nodes;
    uint32_t *picture_users; // how many textures show each picture; NULL until it is asked for
    uint32_t steps;          // taken upwards
    int32_t white; // the material that the batch showed last where a primitive has none, or BD_NONE
    enum bd_err err;
    struct bd_err_detail *detail;
};

// "ops[3].set_light.FIELD", or without FIELD where it is "".
void bd_edit_fail(struct bd_edit *edit, enum bd_err err, const char *field, const char *format, ...)
    BD_PRINTF(4, 5);
void bd_edit_fail_memory(struct bd_edit *edit);

void bd_edit_note(struct bd_edit *edit, struct bd_edit_list *list, enum bd_object_kind kind,
                  uint32_t id);
// Notes that an object is part of the delta.
void bd_edit_touch(struct bd_edit *edit, enum bd_object_kind kind, uint32_t id);
// The next free slot of a kind, touched.
uint32_t bd_edit_next(struct bd_edit *edit, enum bd_object_kind kind);
// What an operation names by `id`: -1 if there is no such thing, after an error.
int32_t bd_edit_target(struct bd_edit *edit, enum bd_object_kind kind);
// What `value` refers to, BD_NONE included.
int32_t bd_edit_reference(struct bd_edit *edit, const char *field, enum bd_object_kind kind,
                          int32_t value);

void bd_edit_name(struct bd_edit *edit, const char *name, char out[64]);
// Refused where the row says so.
void bd_edit_numbers(struct bd_edit *edit, const struct bd_object_field *row, const double *values,
                     size_t count, float *out);
// What the operation gives of a row; NULL: nothing.
const struct bd_field_value *bd_edit_given(const struct bd_edit_op *op, const char *name);
void bd_edit_field(struct bd_edit *edit, const struct bd_object_field *row,
                   const struct bd_field_value *value, void *object);
// All that the operation gives and the object has, but for one that the caller sees to (or NULL).
void bd_edit_fields(struct bd_edit *edit, const struct bd_edit_op *op, enum bd_object_kind kind,
                    const char *but, void *object);

void bd_edit_node(struct bd_edit *edit, const struct bd_edit_op *op);
void bd_edit_mesh(struct bd_edit *edit, const struct bd_edit_op *op);
void bd_edit_material(struct bd_edit *edit, const struct bd_edit_op *op);
void bd_edit_texture(struct bd_edit *edit, const struct bd_edit_op *op);
void bd_edit_light(struct bd_edit *edit, const struct bd_edit_op *op);
void bd_edit_camera(struct bd_edit *edit, const struct bd_edit_op *op);
void bd_edit_environment(struct bd_edit *edit, const struct bd_edit_op *op);
void bd_edit_import(struct bd_edit *edit, const struct bd_edit_op *op);

// edit_removal.c: notes a removal; and after the last operation, empties what is below removed
// nodes and refuses removals of what is in use.
void bd_edit_remove(struct bd_edit *edit, enum bd_object_kind kind);
void bd_edit_settle_removals(struct bd_edit *edit);

// The node above one, BD_NONE at the end. Each such step counts: beyond the limit it is an error.
int32_t bd_edit_above(struct bd_edit *edit, int32_t node);

// How many textures of the draft show each picture, to be kept up by who changes that. NULL after a
// error.
uint32_t *bd_edit_picture_users(struct bd_edit *edit);

// The material that primitives without one show, added once it is needed.
int32_t bd_edit_white_material(struct bd_edit *edit);

#endif
