// Edits of nodes: transforms, parents, what they hold.

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "scene/edit/edit_parts.h"

// `inside` is where the transform stands: "transform." in a node, "" alone.
static void check_components(struct bd_edit *edit, const char *inside, const char *name,
                             const double *values, int count, double most)
{
    char field[48];
    snprintf(field, sizeof field, "%s%s", inside, name);
    for (int i = 0; i < count; i++)
        if (!(fabs(values[i]) <= most))
            bd_edit_fail(edit, BD_ERR_USAGE, field, "%.9g is not in [%.9g, %.9g]", values[i], -most,
                         most);
}

static void set_matrix(struct bd_edit *edit, const char *inside, const struct bd_transform_edit *in,
                       bd_dmat4 *out)
{
    const double *m = in->matrix;
    char field[48];
    check_components(edit, inside, "matrix", m, 16, BD_COORDINATE_MAX_M);
    snprintf(field, sizeof field, "%smatrix", inside);
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
        bd_edit_fail(edit, BD_ERR_USAGE, field, "its last row is not 0 0 0 1");
    if (in->given & ~(uint32_t)BD_GIVEN_MATRIX)
        bd_edit_fail(edit, BD_ERR_USAGE, field, "excludes translation, rotation and scale");
    memcpy(out->m, m, sizeof out->m);
}

static void set_transform(struct bd_edit *edit, const char *inside,
                          const struct bd_transform_edit *in, bd_dmat4 *out)
{
    double translation[3] = {0, 0, 0}, rotation[4] = {0, 0, 0, 1}, scale[3] = {1, 1, 1};
    if (in->given & BD_GIVEN_MATRIX) {
        set_matrix(edit, inside, in, out);
        return;
    }
    if (in->given & BD_GIVEN_TRANSLATION) {
        memcpy(translation, in->translation, sizeof translation);
        check_components(edit, inside, "translation", translation, 3, BD_COORDINATE_MAX_M);
    }
    if (in->given & BD_GIVEN_ROTATION) {
        char field[48];
        memcpy(rotation, in->rotation, sizeof rotation);
        check_components(edit, inside, "rotation", rotation, 4, BD_COORDINATE_MAX_M);
        snprintf(field, sizeof field, "%srotation", inside);
        if (!(fabs(rotation[0]) + fabs(rotation[1]) + fabs(rotation[2]) + fabs(rotation[3]) >
              1e-15))
            bd_edit_fail(edit, BD_ERR_USAGE, field, "is zero");
    }
    if (in->given & BD_GIVEN_SCALE) {
        memcpy(scale, in->scale, sizeof scale);
        check_components(edit, inside, "scale", scale, 3, BD_COORDINATE_MAX_M);
    }
    if (edit->err == BD_ERR_OK) *out = bd_dmat4_from_trs(translation, rotation, scale);
}

// The draft's parents form a forest at all times, so the walk ends. Nothing is below a new node.
static void set_parent(struct bd_edit *edit, int32_t id, int32_t value)
{
    struct bd_node *nodes = edit->draft->nodes;
    const bool is_new = edit->ops[edit->op].kind == BD_EDIT_ADD_NODE;
    int32_t parent = bd_edit_reference(edit, "parent", BD_OBJECT_NODE, value);
    for (int32_t n = parent; n != BD_NONE; n = is_new ? BD_NONE : bd_edit_above(edit, n))
        if (n == id) {
            bd_edit_fail(edit, BD_ERR_USAGE, "parent", "node %d is below node %d itself", parent,
                         id);
            return;
        }
    if (edit->err == BD_ERR_OK) nodes[id].parent = parent;
}

static void set_fields(struct bd_edit *edit, const struct bd_edit_op *op, int32_t id)
{
    struct bd_node *node = &edit->draft->nodes[id];
    const int32_t mesh = node->mesh;
    const struct bd_field_value *parent = bd_edit_given(op, "parent");
    if (parent) set_parent(edit, id, parent->whole);
    bd_edit_fields(edit, op, BD_OBJECT_NODE, "parent", node);
    // What was baked in world space was the mesh, not the node.
    if (node->mesh != mesh) node->mesh_is_world_space = false;
}

void bd_edit_node(struct bd_edit *edit, const struct bd_edit_op *op)
{
    bool adds = op->kind == BD_EDIT_ADD_NODE;
    int32_t id =
        adds ? (int32_t)bd_edit_next(edit, BD_OBJECT_NODE) : bd_edit_target(edit, BD_OBJECT_NODE);
    if (id == BD_NONE) return;
    struct bd_node *node = &edit->draft->nodes[id];
    if (op->kind == BD_EDIT_SET_TRANSFORM) {
        set_transform(edit, "", &op->transform, &node->parent_from_node);
        return;
    }
    if (adds) *node = (struct bd_node){.parent_from_node = bd_dmat4_identity()};
    if (adds) bd_object_set_standards(BD_OBJECT_NODE, node);
    set_fields(edit, op, id);
    if (op->transform.is_given)
        set_transform(edit, "transform.", &op->transform, &node->parent_from_node);
    if (adds) edit->ids[edit->op] = id;
}
