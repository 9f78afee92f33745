#include "net/edit_decode.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/assert.h"
#include "protocol/wire.h"

// Where a fault lies, for all that one operation holds.
struct decoding {
    const char *path;
    struct bd_fault *fault;
    enum bd_err err; // the first one stays
};

static void refuse(struct decoding *at, const char *field, const char *format, const char *word)
{
    if (at->err) return;
    char path[128];
    snprintf(path, sizeof path, "%s%s%s", at->path, field[0] ? "." : "", field);
    at->err = bd_fault_set(at->fault, BD_ERR_USAGE, path, format, word);
}

// --- fields ---------------------------------------------------------------------------------

static uint32_t take_text(const char *from, const char **to, uint32_t bit)
{
    if (!from) return 0;
    *to = from;
    return bit;
}

static uint32_t take_number(protobuf_c_boolean has, double from, double *to, uint32_t bit)
{
    if (!has) return 0;
    *to = from;
    return bit;
}

static uint32_t take_bool(protobuf_c_boolean has, protobuf_c_boolean from, bool *to, uint32_t bit)
{
    if (!has) return 0;
    *to = from;
    return bit;
}

static uint32_t take_id(protobuf_c_boolean has, int32_t from, int32_t *to, uint32_t bit)
{
    if (!has) return 0;
    *to = from;
    return bit;
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

// One of `words`, up to a NULL.
static uint32_t take_word(struct decoding *at, const char *field, const char *from,
                          const char *const *words, const char *choices, int *to, uint32_t bit)
{
    if (!from) return 0;
    for (int i = 0; words[i]; i++) {
        if (strcmp(from, words[i]) != 0) continue;
        *to = i;
        return bit;
    }
    refuse(at, field, "is one of %s", choices);
    return 0;
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

static void decode_node(struct decoding *at, const Bounced__NodeEdit *in, bool is_set,
                        struct bd_edit_op *op)
{
    struct bd_node_edit *out = &op->node;
    op->id = object_of(at, is_set, in->has_node, in->node);
    out->given = take_text(in->name, &out->name, BD_GIVEN_NODE_NAME) |
                 take_id(in->has_parent, in->parent, &out->parent, BD_GIVEN_NODE_PARENT) |
                 take_id(in->has_mesh, in->mesh, &out->mesh, BD_GIVEN_NODE_MESH) |
                 take_id(in->has_camera, in->camera, &out->camera, BD_GIVEN_NODE_CAMERA) |
                 take_id(in->has_light, in->light, &out->light, BD_GIVEN_NODE_LIGHT) |
                 take_bool(in->has_shown, in->shown, &out->shown, BD_GIVEN_NODE_SHOWN);
    if (!in->transform) return;
    if (in->transform->has_node) refuse(at, "transform.node", "%s", "stays unset here");
    decode_transform(at, in->transform, &out->transform);
    out->given |= BD_GIVEN_NODE_TRANSFORM;
}

static void decode_set_transform(struct decoding *at, const Bounced__TransformEdit *in,
                                 struct bd_edit_op *op)
{
    op->id = object_of(at, true, in->has_node, in->node);
    decode_transform(at, in, &op->transform);
}

static void decode_maps(const Bounced__MaterialEdit *in, struct bd_material_edit *out)
{
    const struct {
        protobuf_c_boolean has;
        int32_t texture;
    } maps[BD_MAP_COUNT] = {
        [BD_MAP_BASE_COLOR] = {in->has_base_color_texture, in->base_color_texture},
        [BD_MAP_METALLIC_ROUGHNESS] = {in->has_metallic_roughness_texture,
                                       in->metallic_roughness_texture},
        [BD_MAP_NORMAL] = {in->has_normal_texture, in->normal_texture},
        [BD_MAP_EMISSIVE] = {in->has_emissive_texture, in->emissive_texture},
        [BD_MAP_TRANSMISSION] = {in->has_transmission_texture, in->transmission_texture},
    };
    for (int map = 0; map < BD_MAP_COUNT; map++)
        out->given |= take_id(maps[map].has, maps[map].texture, &out->textures[map],
                              (uint32_t)BD_GIVEN_MAP << map);
}

static void decode_material(struct decoding *at, const Bounced__MaterialEdit *in, bool is_set,
                            struct bd_edit_op *op)
{
    static const char *const modes[] = {"opaque", "mask", "blend", NULL};
    struct bd_material_edit *out = &op->material;
    int mode = 0;
    op->id = object_of(at, is_set, in->has_material, in->material);
    out->given =
        take_text(in->name, &out->name, BD_GIVEN_MATERIAL_NAME) |
        take_list(at, "base_color", in->n_base_color, in->base_color, 4, out->base_color,
                  BD_GIVEN_BASE_COLOR) |
        take_number(in->has_metallic, in->metallic, &out->metallic, BD_GIVEN_METALLIC) |
        take_number(in->has_roughness, in->roughness, &out->roughness, BD_GIVEN_ROUGHNESS) |
        take_list(at, "emissive", in->n_emissive, in->emissive, 3, out->emissive,
                  BD_GIVEN_EMISSIVE) |
        take_number(in->has_normal_scale, in->normal_scale, &out->normal_scale,
                    BD_GIVEN_NORMAL_SCALE) |
        take_number(in->has_ior, in->ior, &out->ior, BD_GIVEN_IOR) |
        take_number(in->has_transmission, in->transmission, &out->transmission,
                    BD_GIVEN_TRANSMISSION) |
        take_number(in->has_thickness, in->thickness, &out->thickness, BD_GIVEN_THICKNESS) |
        take_number(in->has_attenuation_distance, in->attenuation_distance,
                    &out->attenuation_distance, BD_GIVEN_ATTENUATION_DISTANCE) |
        take_list(at, "attenuation_color", in->n_attenuation_color, in->attenuation_color, 3,
                  out->attenuation_color, BD_GIVEN_ATTENUATION_COLOR) |
        take_word(at, "alpha_mode", in->alpha_mode, modes, "opaque, mask, blend", &mode,
                  BD_GIVEN_ALPHA_MODE) |
        take_number(in->has_alpha_cutoff, in->alpha_cutoff, &out->alpha_cutoff,
                    BD_GIVEN_ALPHA_CUTOFF) |
        take_bool(in->has_double_sided, in->double_sided, &out->double_sided,
                  BD_GIVEN_DOUBLE_SIDED) |
        take_bool(in->has_unlit, in->unlit, &out->unlit, BD_GIVEN_UNLIT);
    out->alpha_mode = (enum bd_alpha_mode)mode;
    decode_maps(in, out);
}

static void decode_texture(struct decoding *at, const Bounced__TextureEdit *in, bool is_set,
                           struct bd_edit_op *op)
{
    static const char *const wraps[] = {"repeat", "clamp", "mirror", NULL};
    static const char choices[] = "repeat, clamp, mirror";
    struct bd_texture_edit *out = &op->texture;
    int wrap_s = 0, wrap_t = 0;
    op->id = object_of(at, is_set, in->has_texture, in->texture);
    if (!is_set && !in->blob) refuse(at, "blob", "%s", "a texture needs a picture");
    out->given = take_word(at, "wrap_s", in->wrap_s, wraps, choices, &wrap_s, BD_GIVEN_WRAP_S) |
                 take_word(at, "wrap_t", in->wrap_t, wraps, choices, &wrap_t, BD_GIVEN_WRAP_T) |
                 take_bool(in->has_nearest, in->nearest, &out->nearest, BD_GIVEN_NEAREST);
    out->wrap_s = (enum bd_wrap)wrap_s;
    out->wrap_t = (enum bd_wrap)wrap_t;
}

static void decode_light(struct decoding *at, const Bounced__LightEdit *in, bool is_set,
                         struct bd_edit_op *op)
{
    static const char *const kinds[] = {"directional", "point", "spot", NULL};
    struct bd_light_edit *out = &op->light;
    int kind = 0;
    op->id = object_of(at, is_set, in->has_light, in->light);
    out->given =
        take_text(in->name, &out->name, BD_GIVEN_LIGHT_NAME) |
        take_word(at, "kind", in->kind, kinds, "directional, point, spot", &kind,
                  BD_GIVEN_LIGHT_KIND) |
        take_list(at, "color", in->n_color, in->color, 3, out->color, BD_GIVEN_COLOR) |
        take_number(in->has_intensity, in->intensity, &out->intensity, BD_GIVEN_INTENSITY) |
        take_number(in->has_range, in->range, &out->range, BD_GIVEN_RANGE) |
        take_number(in->has_cone_inner, in->cone_inner, &out->cone_inner, BD_GIVEN_CONE_INNER) |
        take_number(in->has_cone_outer, in->cone_outer, &out->cone_outer, BD_GIVEN_CONE_OUTER);
    out->kind = (enum bd_light_kind)kind;
}

static void decode_camera(struct decoding *at, const Bounced__CameraEdit *in, bool is_set,
                          struct bd_edit_op *op)
{
    struct bd_camera_edit *out = &op->camera;
    op->id = object_of(at, is_set, in->has_camera, in->camera);
    out->given = take_text(in->name, &out->name, BD_GIVEN_CAMERA_NAME) |
                 take_bool(in->has_orthographic, in->orthographic, &out->orthographic,
                           BD_GIVEN_ORTHOGRAPHIC) |
                 take_number(in->has_yfov, in->yfov, &out->yfov, BD_GIVEN_YFOV) |
                 take_number(in->has_xmag, in->xmag, &out->xmag, BD_GIVEN_XMAG) |
                 take_number(in->has_ymag, in->ymag, &out->ymag, BD_GIVEN_YMAG) |
                 take_number(in->has_near, in->near, &out->near, BD_GIVEN_NEAR) |
                 take_number(in->has_far, in->far, &out->far, BD_GIVEN_FAR);
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
             known ? bd_edit_kind_name(kind) : "");
    return path;
}

static void decode_one(struct decoding *at, const Bounced__EditOp *op, struct bd_edit_op *out)
{
    switch (out->kind) {
    case BD_EDIT_ADD_NODE:
    case BD_EDIT_SET_NODE:
        decode_node(at, op->add_node, out->kind == BD_EDIT_SET_NODE, out);
        break;
    case BD_EDIT_SET_TRANSFORM:
        decode_set_transform(at, op->set_transform, out);
        break;
    case BD_EDIT_ADD_MESH:
    case BD_EDIT_SET_MESH:
        decode_mesh(at, op->add_mesh, out->kind == BD_EDIT_SET_MESH, out);
        break;
    case BD_EDIT_SET_MESH_VERTICES:
        out->id = object_of(at, true, op->set_mesh_vertices->has_mesh, op->set_mesh_vertices->mesh);
        break;
    case BD_EDIT_ADD_MATERIAL:
    case BD_EDIT_SET_MATERIAL:
        decode_material(at, op->add_material, out->kind == BD_EDIT_SET_MATERIAL, out);
        break;
    case BD_EDIT_ADD_TEXTURE:
    case BD_EDIT_SET_TEXTURE:
        decode_texture(at, op->add_texture, out->kind == BD_EDIT_SET_TEXTURE, out);
        break;
    case BD_EDIT_ADD_LIGHT:
    case BD_EDIT_SET_LIGHT:
        decode_light(at, op->add_light, out->kind == BD_EDIT_SET_LIGHT, out);
        break;
    case BD_EDIT_ADD_CAMERA:
    case BD_EDIT_SET_CAMERA:
        decode_camera(at, op->add_camera, out->kind == BD_EDIT_SET_CAMERA, out);
        break;
    case BD_EDIT_REMOVE_NODE:
    case BD_EDIT_REMOVE_MESH:
    case BD_EDIT_REMOVE_MATERIAL:
    case BD_EDIT_REMOVE_TEXTURE:
    case BD_EDIT_REMOVE_LIGHT:
    case BD_EDIT_REMOVE_CAMERA:
        decode_removal(at, op->remove_node, out);
        break;
    case BD_EDIT_SET_ENVIRONMENT:
        break; // its map decides: edit_heavy.c
    case BD_EDIT_IMPORT:
        decode_import(op->import, out);
        break;
    case BD_EDIT_KIND_COUNT:
        BD_ASSERT(!"no kind");
    }
}

enum bd_err bd_edit_decode(size_t index, const Bounced__EditOp *op, struct bd_edit_op *out,
                           struct bd_fault *fault)
{
    *out = (struct bd_edit_op){.id = BD_NONE};
    struct bd_edit_path path = bd_edit_path(index, op);
    if (!kind_of(op, &out->kind))
        return bd_fault_set(fault, BD_ERR_UNSUPPORTED, path.text,
                            "this server knows no such operation");
    // The path has the operation's name; its own unknown fields would be others beside it.
    char place[32];
    snprintf(place, sizeof place, "ops[%zu]", index);
    enum bd_err err = bd_wire_check_known(&op->base, place, fault);
    if (err) return err;
    struct decoding at = {.path = path.text, .fault = fault};
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
