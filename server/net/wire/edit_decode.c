#include "net/wire/edit_decode.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/assert.h"
#include "net/wire/object_message.h"
#include "protocol/wire.h"

// Where an error lies, for all that one operation holds.
struct decoding {
    const char *path;
    struct bd_err_detail *detail;
    enum bd_err err; // the first one stays
};

static void refuse(struct decoding *at, const char *field, const char *format, const char *word)
{
    if (at->err) return;
    char path[128];
    snprintf(path, sizeof path, "%s%s%s", at->path, field[0] ? "." : "", field);
    at->err = bd_err_set(at->detail, BD_ERR_USAGE, path, format, word);
}

// A list of exactly `count` numbers, or none.
static uint32_t take_list(struct decoding *at, const char *field, size_t size, const double *from,
                          size_t count, double *to, uint32_t bit)
{
    if (size == 0) return 0;
    if (size != count) {
        char wanted[24];
        snprintf(wanted, sizeof wanted, "%zu", count);
        refuse(at, field, "takes %s numbers", wanted);
        return 0;
    }
    memcpy(to, from, count * sizeof *to);
    return bit;
}

static int32_t object_of(struct decoding *at, bool is_set, protobuf_c_boolean has, int32_t id)
{
    if (is_set && !has) refuse(at, "", "%s", "names no object to change");
    if (!is_set && has) refuse(at, "", "%s", "an id is given by the server: leave it out");
    return is_set ? id : BD_NONE;
}

// --- operations -----------------------------------------------------------------------------

static void decode_transform(struct decoding *at, const Bounced__TransformEdit *in,
                             struct bd_transform_edit *out)
{
    out->given =
        take_list(at, "translation", in->n_translation, in->translation, 3, out->translation,
                  BD_GIVEN_TRANSLATION) |
        take_list(at, "rotation", in->n_rotation, in->rotation, 4, out->rotation,
                  BD_GIVEN_ROTATION) |
        take_list(at, "scale", in->n_scale, in->scale, 3, out->scale, BD_GIVEN_SCALE) |
        take_list(at, "matrix", in->n_matrix, in->matrix, 16, out->matrix, BD_GIVEN_MATRIX);
}

static void decode_set_transform(struct decoding *at, const Bounced__TransformEdit *in,
                                 struct bd_edit_op *op)
{
    op->id = object_of(at, true, in->has_node, in->node);
    decode_transform(at, in, &op->transform);
}

static void decode_object(struct decoding *at, enum bd_object_kind kind, const ProtobufCMessage *in,
                          bool is_set, struct bd_edit_op *op)
{
    int32_t id;
    const bool has_id = bd_object_message_id(kind, in, &id);
    op->id = object_of(at, is_set, has_id, id);
    bd_object_message_read(kind, in, op);
}

static void decode_node(struct decoding *at, const Bounced__NodeEdit *in, bool is_set,
                        struct bd_edit_op *op)
{
    decode_object(at, BD_OBJECT_NODE, &in->base, is_set, op);
    op->transform.is_given = in->transform;
    if (!in->transform) return;
    if (in->transform->has_node) refuse(at, "transform.node", "%s", "stays unset here");
    decode_transform(at, in->transform, &op->transform);
}

static void decode_texture(struct decoding *at, const Bounced__TextureEdit *in, bool is_set,
                           struct bd_edit_op *op)
{
    decode_object(at, BD_OBJECT_TEXTURE, &in->base, is_set, op);
    if (!is_set && !in->blob) refuse(at, "blob", "%s", "a texture needs a picture");
}

static void decode_mesh(struct decoding *at, const Bounced__MeshEdit *in, bool is_set,
                        struct bd_edit_op *op)
{
    op->id = object_of(at, is_set, in->has_mesh, in->mesh);
    op->mesh.name = in->name;
    if (!is_set && in->n_primitives == 0)
        refuse(at, "primitives", "%s", "a mesh needs at least one primitive");
}

static void decode_import(const Bounced__ImportEdit *in, struct bd_edit_op *op)
{
    op->id = BD_NONE;
    op->import.parent = in->has_parent ? in->parent : BD_NONE;
    op->import.name = in->name;
}

static void decode_removal(struct decoding *at, const Bounced__Removal *in, struct bd_edit_op *op)
{
    op->id = object_of(at, true, in->has_id, in->id);
}

// --- which ----------------------------------------------------------------------------------

// In the order of the schema, which is that of BD_EDIT_MAP.
static bool kind_of(const Bounced__EditOp *op, enum bd_edit_kind *kind)
{
    if (op->op_case < BOUNCED__EDIT_OP__OP_ADD_NODE || op->op_case > BOUNCED__EDIT_OP__OP_IMPORT)
        return false;
    *kind = (enum bd_edit_kind)(op->op_case - BOUNCED__EDIT_OP__OP_ADD_NODE);
    return true;
}
_Static_assert(BOUNCED__EDIT_OP__OP_IMPORT - BOUNCED__EDIT_OP__OP_ADD_NODE == BD_EDIT_IMPORT &&
                   BD_EDIT_IMPORT == BD_EDIT_KIND_COUNT - 1,
               "the schema's operations and BD_EDIT_MAP are one list");

struct bd_edit_path bd_edit_path(size_t index, const Bounced__EditOp *op)
{
    struct bd_edit_path path;
    enum bd_edit_kind kind;
    bool known = kind_of(op, &kind);
    snprintf(path.text, sizeof path.text, "ops[%zu]%s%s", index, known ? "." : "",
             known ? bd_edit_kinds[kind].name : "");
    return path;
}

// The members of the oneof are pointers to messages: one is as good as another to reach them.
static void decode_one(struct decoding *at, const Bounced__EditOp *op, struct bd_edit_op *out)
{
    const struct bd_edit_kind_row *row = &bd_edit_kinds[out->kind];
    const bool is_set = row->does == BD_EDIT_SETS;
    if (row->does == BD_EDIT_REMOVES)
        decode_removal(at, op->remove_node, out);
    else if (out->kind == BD_EDIT_IMPORT)
        decode_import(op->import, out);
    else if (out->kind == BD_EDIT_SET_TRANSFORM)
        decode_set_transform(at, op->set_transform, out);
    else if (out->kind == BD_EDIT_SET_MESH_VERTICES)
        out->id = object_of(at, true, op->set_mesh_vertices->has_mesh, op->set_mesh_vertices->mesh);
    else if (row->object == BD_OBJECT_NODE)
        decode_node(at, op->add_node, is_set, out);
    else if (row->object == BD_OBJECT_MESH)
        decode_mesh(at, op->add_mesh, is_set, out);
    else if (row->object == BD_OBJECT_TEXTURE)
        decode_texture(at, op->add_texture, is_set, out);
    else if (row->object != BD_OBJECT_ENVIRONMENT) // whose map decides: edit_heavy.c
        decode_object(at, row->object, &op->add_material->base, is_set, out);
}

enum bd_err bd_edit_decode(size_t index, const Bounced__EditOp *op, struct bd_edit_op *out,
                           struct bd_err_detail *detail)
{
    *out = (struct bd_edit_op){.id = BD_NONE};
    struct bd_edit_path path = bd_edit_path(index, op);
    if (!kind_of(op, &out->kind))
        return bd_err_set(detail, BD_ERR_UNSUPPORTED, path.text,
                          "this server knows no such operation");
    // The path has the operation's name; its own unknown fields would be others beside it.
    char place[32];
    snprintf(place, sizeof place, "ops[%zu]", index);
    enum bd_err err = bd_wire_check_known(&op->base, place, detail);
    if (err) return err;
    struct decoding at = {.path = path.text, .detail = detail};
    decode_one(&at, op, out);
    return at.err;
}

// --- weight -----------------------------------------------------------------------------------

static bool names_blob(const Bounced__PrimitiveEdit *primitive)
{
    const Bounced__Data *const streams[] = {
        primitive->positions, primitive->normals, primitive->tangents, primitive->uv0,
        primitive->uv1,       primitive->colors,  primitive->indices};
    for (size_t i = 0; i < sizeof streams / sizeof streams[0]; i++)
        if (streams[i] && streams[i]->blob) return true;
    return false;
}

static enum bd_edit_weight mesh_weight(const Bounced__MeshEdit *mesh)
{
    if (mesh->n_primitives == 0) return BD_EDIT_LIGHT;
    for (size_t p = 0; p < mesh->n_primitives; p++)
        if (names_blob(mesh->primitives[p])) return BD_EDIT_CONTENT;
    return BD_EDIT_STREAM;
}

static enum bd_edit_weight vertices_weight(const Bounced__MeshVertices *vertices)
{
    const bool has_blob = (vertices->positions && vertices->positions->blob) ||
                          (vertices->normals && vertices->normals->blob);
    return has_blob ? BD_EDIT_CONTENT : BD_EDIT_STREAM;
}

enum bd_edit_weight bd_edit_weight(const Bounced__EditOp *op)
{
    switch (op->op_case) {
    case BOUNCED__EDIT_OP__OP_ADD_MESH:
    case BOUNCED__EDIT_OP__OP_SET_MESH:
        return mesh_weight(op->add_mesh);
    case BOUNCED__EDIT_OP__OP_SET_MESH_VERTICES:
        return vertices_weight(op->set_mesh_vertices);
    case BOUNCED__EDIT_OP__OP_ADD_TEXTURE:
    case BOUNCED__EDIT_OP__OP_SET_TEXTURE:
        return op->add_texture->blob ? BD_EDIT_CONTENT : BD_EDIT_LIGHT;
    case BOUNCED__EDIT_OP__OP_SET_ENVIRONMENT:
        return op->set_environment->map ? BD_EDIT_CONTENT : BD_EDIT_STREAM;
    case BOUNCED__EDIT_OP__OP_IMPORT:
        return BD_EDIT_FILES;
    default:
        return BD_EDIT_LIGHT;
    }
}

enum bd_edit_weight bd_edit_batch_weight(const Bounced__EditBatch *batch)
{
    enum bd_edit_weight most = BD_EDIT_LIGHT;
    for (size_t i = 0; i < batch->n_ops; i++) {
        const enum bd_edit_weight weight = bd_edit_weight(batch->ops[i]);
        if (weight > most) most = weight;
    }
    return most;
}
