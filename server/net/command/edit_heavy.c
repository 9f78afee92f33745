#include "net/command/edit_heavy.h"

#include <float.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/command/edit_budget.h"
#include "net/command/environment.h"
#include "net/command/import_files.h"
#include "net/wire/edit_decode.h"
#include "scene/import/import.h"
#include "scene/model/content.h"

// What one operation reads, and where an error of it lies.
struct reading {
    const struct bd_edit_heavy_inputs *inputs;
    struct bd_edit_path path; // "ops[2].add_mesh"
    struct bd_edit_flags *flags;
    struct bd_err_detail *detail;
};

static enum bd_err refuse(const struct reading *reading, enum bd_err err, const char *part,
                          const char *message)
{
    char path[256];
    snprintf(path, sizeof path, "%s.%s", reading->path.text, part);
    return bd_err_set(reading->detail, err, path, "%s", message);
}

static void flag(const struct reading *reading, const char *name, uint32_t count)
{
    struct bd_edit_flags *flags = reading->flags;
    if (count == 0 || flags->count == BD_EDIT_FLAG_MAX) return;
    snprintf(flags->text[flags->count++], BD_EDIT_FLAG_BYTES, "%s: %" PRIu32, name, count);
}

// --- Data -----------------------------------------------------------------------------------

static enum bd_err spend(const struct reading *reading, const char *part, uint64_t bytes)
{
    char path[256];
    snprintf(path, sizeof path, "%s.%s", reading->path.text, part);
    return bd_edit_budget_take(reading->inputs->budget, bytes, path, reading->detail);
}

// Numbers of four bytes, copied: sources are aligned as they like.
struct array {
    void *words;
    size_t count;
};

static enum bd_err copy_words(const struct reading *reading, const char *part, const void *bytes,
                              size_t size, struct array *out)
{
    if (size % 4 != 0)
        return refuse(reading, BD_ERR_USAGE, part, "its bytes are no whole number of four");
    enum bd_err err = spend(reading, part, size);
    if (err) return err;
    out->words = malloc(size + 1);
    if (!out->words) return refuse(reading, BD_ERR_NO_MEMORY, part, "no memory for it");
    memcpy(out->words, bytes, size);
    out->count = size / 4;
    return BD_ERR_OK;
}

static enum bd_err copy_slice(const struct reading *reading, const char *part,
                              const Bounced__Data *data, const uint8_t *bytes, size_t size,
                              struct array *out)
{
    if (data->offset > size || (data->has_size_bytes && data->size_bytes > size - data->offset))
        return refuse(reading, BD_ERR_USAGE, part, "reaches beyond the end of its bytes");
    size_t taken = data->has_size_bytes ? (size_t)data->size_bytes : size - (size_t)data->offset;
    return copy_words(reading, part, bytes + data->offset, taken, out);
}

static enum bd_err copy_blob(const struct reading *reading, const char *part,
                             const Bounced__Data *data, struct array *out)
{
    char path[128];
    struct bd_blob_map map;
    snprintf(path, sizeof path, "%s.%s", reading->path.text, part);
    enum bd_err err =
        bd_net_map_blob(reading->inputs->blobs, path, data->blob, &map, reading->detail);
    if (err) return err;
    err = copy_slice(reading, part, data, map.bytes, map.size_bytes, out);
    bd_blob_unmap(&map);
    return err;
}

// NULL: not given, and `out` stays empty.
static enum bd_err read_data(const struct reading *reading, const char *part,
                             const Bounced__Data *data, struct array *out)
{
    if (!data) return BD_ERR_OK;
    int sources =
        (data->n_values > 0) + (data->blob != NULL) + (data->has_payload && data->payload);
    if (sources != 1)
        return refuse(reading, BD_ERR_USAGE, part,
                      "takes values, a blob or the payload: one of them");
    if (data->blob) return copy_blob(reading, part, data, out);
    if (data->n_values > 0)
        return copy_words(reading, part, data->values, data->n_values * sizeof(float), out);
    return copy_slice(reading, part, data, reading->inputs->payload, reading->inputs->payload_bytes,
                      out);
}

// --- meshes ---------------------------------------------------------------------------------

enum { POSITIONS, NORMALS, TANGENTS, UV0, UV1, COLORS, INDICES, STREAM_COUNT };
static const struct {
    const char *name;
    uint32_t width;
} streams[STREAM_COUNT] = {{"positions", 3}, {"normals", 3}, {"tangents", 4}, {"uv0", 2},
                           {"uv1", 2},       {"colors", 4},  {"indices", 1}};

struct primitive {
    struct array arrays[STREAM_COUNT];
};

static void free_primitives(struct primitive *primitives, size_t count)
{
    for (size_t p = 0; p < count; p++)
        for (int s = 0; s < STREAM_COUNT; s++) free(primitives[p].arrays[s].words);
    free(primitives);
}

// Indices given as numbers: whole ones, which floats hold exactly below 2^24.
static bool make_whole(struct array *indices)
{
    for (size_t i = 0; i < indices->count; i++) {
        float value;
        uint32_t whole;
        memcpy(&value, (uint8_t *)indices->words + 4 * i, sizeof value);
        if (!(value >= 0 && value < 16777216.f)) return false;
        whole = (uint32_t)value;
        if ((float)whole != value) return false;
        memcpy((uint8_t *)indices->words + 4 * i, &whole, sizeof whole);
    }
    return true;
}

static enum bd_err check_stream(const struct reading *reading, const char *part, int stream,
                                const struct primitive *primitive)
{
    const struct array *array = &primitive->arrays[stream];
    if (!array->words || stream == INDICES) return BD_ERR_OK;
    const size_t vertices = primitive->arrays[POSITIONS].count / 3;
    if (array->count == vertices * streams[stream].width && vertices <= UINT32_MAX)
        return BD_ERR_OK;
    return refuse(reading, BD_ERR_USAGE, part, "has not as many vertices as the positions");
}

// What bd_edit_build_mesh makes where nothing was sent.
static uint64_t made_bytes(const struct primitive *primitive)
{
    const struct array *sent = primitive->arrays;
    const bool has_tangents = sent[TANGENTS].words && sent[NORMALS].words;
    uint64_t numbers = 0; // a vertex
    if (!sent[NORMALS].words) numbers += 3;
    if (sent[UV0].words && !has_tangents) numbers += 4;
    if (!sent[INDICES].words) numbers += 1;
    return 4 * numbers * (sent[POSITIONS].count / 3);
}

static enum bd_err read_primitive(const struct reading *reading, size_t p,
                                  const Bounced__PrimitiveEdit *in, struct primitive *out)
{
    const Bounced__Data *const data[STREAM_COUNT] = {
        in->positions, in->normals, in->tangents, in->uv0, in->uv1, in->colors, in->indices};
    enum bd_err err = BD_ERR_OK;
    char part[64];
    for (int s = 0; !err && s < STREAM_COUNT; s++) {
        snprintf(part, sizeof part, "primitives[%zu].%s", p, streams[s].name);
        err = read_data(reading, part, data[s], &out->arrays[s]);
        if (!err) err = check_stream(reading, part, s, out);
        if (!err && s == POSITIONS && out->arrays[s].count == 0)
            err = refuse(reading, BD_ERR_USAGE, part, "a primitive needs positions");
        if (!err && s == INDICES && in->indices && in->indices->n_values > 0 &&
            !make_whole(&out->arrays[s]))
            err = refuse(reading, BD_ERR_USAGE, part, "are whole numbers from 0 to 16777215");
    }
    snprintf(part, sizeof part, "primitives[%zu]", p);
    return err ? err : spend(reading, part, made_bytes(out));
}

static enum bd_err build_mesh(const struct reading *reading, const Bounced__MeshEdit *in,
                              const struct primitive *primitives, struct bd_mesh **out)
{
    struct bd_primitive_source *sources = calloc(in->n_primitives, sizeof *sources);
    BD_ASSERT(sources);
    for (size_t p = 0; p < in->n_primitives; p++) {
        const struct array *from = primitives[p].arrays;
        sources[p] = (struct bd_primitive_source){
            .material = in->primitives[p]->has_material ? in->primitives[p]->material : BD_NONE,
            .vertex_count = (uint32_t)(from[POSITIONS].count / 3),
            .index_count = (uint32_t)from[INDICES].count,
            .positions = from[POSITIONS].words,
            .normals = from[NORMALS].words,
            .tangents = from[TANGENTS].words,
            .uv = {from[UV0].words, from[UV1].words},
            .colors = from[COLORS].words,
            .indices = from[INDICES].words};
    }
    enum bd_err err = bd_edit_build_mesh(sources, (uint32_t)in->n_primitives, reading->path.text,
                                         out, reading->detail);
    free(sources);
    return err;
}

static enum bd_err read_mesh(const struct reading *reading, const Bounced__MeshEdit *in,
                             struct bd_edit_op *op)
{
    if (in->n_primitives == 0) return BD_ERR_OK; // set_mesh: a name alone
    struct bd_edit_budget *budget = reading->inputs->budget;
    const struct bd_edit_budget before = *budget;
    struct primitive *primitives = calloc(in->n_primitives, sizeof *primitives);
    BD_ASSERT(primitives);
    enum bd_err err = BD_ERR_OK;
    for (size_t p = 0; !err && p < in->n_primitives; p++)
        err = read_primitive(reading, p, in->primitives[p], &primitives[p]);
    if (!err) err = build_mesh(reading, in, primitives, &op->mesh.mesh);
    free_primitives(primitives, in->n_primitives);
    *budget = before; // the copies go, the mesh stays
    if (!err)
        flag(reading, "normals_against_winding", bd_mesh_count_against_winding(op->mesh.mesh));
    return err ? err : spend(reading, "primitives", bd_mesh_bytes(op->mesh.mesh));
}

// What operations before this one made of the mesh, or what it is now.
static const struct bd_mesh *mesh_before(const struct bd_edit_heavy_inputs *inputs,
                                         const struct bd_edit_op *ops, size_t index)
{
    const int32_t id = ops[index].id;
    for (size_t i = index; i-- > 0;)
        if ((ops[i].kind == BD_EDIT_SET_MESH_VERTICES || ops[i].kind == BD_EDIT_SET_MESH) &&
            ops[i].id == id && ops[i].mesh.mesh)
            return ops[i].mesh.mesh;
    bool exists =
        id >= 0 && (uint32_t)id < inputs->base->mesh_count && !inputs->base->meshes[id]->is_removed;
    return exists ? inputs->base->meshes[id] : NULL;
}

static enum bd_err read_vertices(const struct reading *reading, const Bounced__MeshVertices *in,
                                 struct bd_edit_op *ops, size_t index)
{
    const struct bd_mesh *mesh = mesh_before(reading->inputs, ops, index);
    if (!mesh) return refuse(reading, BD_ERR_NOT_FOUND, "mesh", "there is no such mesh yet");
    struct bd_edit_budget *budget = reading->inputs->budget;
    const struct bd_edit_budget before = *budget;
    struct array positions = {0}, normals = {0};
    enum bd_err err = read_data(reading, "positions", in->positions, &positions);
    if (!err) err = read_data(reading, "normals", in->normals, &normals);
    *budget = before; // the copies go
    // However little of it moves, the mesh is made anew.
    if (!err)
        err = bd_edit_budget_hold(budget, bd_mesh_bytes(mesh), reading->path.text, reading->detail);
    if (!err && positions.count == 0)
        err = refuse(reading, BD_ERR_USAGE, "positions", "new places are needed");
    if (!err && positions.count % 3 != 0)
        err = refuse(reading, BD_ERR_USAGE, "positions", "three numbers a vertex are needed");
    if (!err && normals.words && normals.count != positions.count)
        err = refuse(reading, BD_ERR_USAGE, "normals", "has not as many vertices as the positions");
    if (!err)
        err = bd_edit_deform_mesh(mesh, in->primitive, positions.words, normals.words,
                                  (uint32_t)(positions.count / 3), reading->path.text,
                                  &ops[index].mesh.mesh, reading->detail);
    if (!err && normals.words)
        flag(reading, "normals_against_winding",
             bd_mesh_count_against_winding(ops[index].mesh.mesh));
    free(positions.words);
    free(normals.words);
    return err;
}

// --- pictures, maps, files ------------------------------------------------------------------

static enum bd_err read_picture(const struct reading *reading, const char *blob,
                                struct bd_edit_op *op)
{
    if (!blob) return BD_ERR_OK; // set_texture: how it is read alone
    char path[128];
    snprintf(path, sizeof path, "%s.blob", reading->path.text);
    struct bd_blob_map map;
    enum bd_err err = bd_net_map_blob(reading->inputs->blobs, path, blob, &map, reading->detail);
    if (err) return err;
    const struct bd_edit_heavy_inputs *inputs = reading->inputs;
    const struct bd_import_file file = {path, map.bytes, map.size_bytes};
    struct bd_import_limits limits = bd_import_limits_of(inputs->limits);
    struct bd_picture *picture;
    limits.picture_texels = inputs->budget->texels;
    err = bd_import_picture(inputs->import_pool, &file, &limits, &picture, reading->detail);
    bd_blob_unmap(&map);
    if (err) return err;
    op->picture = picture;
    return bd_edit_budget_take_picture(reading->inputs->budget, picture, reading->detail);
}

static enum bd_err spend_map(const struct reading *reading, const struct bd_sky_map *map)
{
    if (!map) return BD_ERR_OK;
    const uint64_t texels = (uint64_t)map->width_px * map->height_px;
    return spend(reading, "map", 3 * sizeof(float) * texels);
}

// An error of the environment, with the operation's path before it.
static enum bd_err read_environment(const struct reading *reading, const Bounced__Environment *in,
                                    struct bd_edit_op *op)
{
    struct bd_net_environment read;
    struct bd_err_detail detail = {0};
    enum bd_err err =
        bd_net_environment_read(in, reading->inputs->blobs, reading->inputs->import_pool,
                                reading->inputs->limits, &read, &detail);
    if (err) {
        const char *dot = strchr(detail.field, '.');
        err = refuse(reading, err, dot ? dot + 1 : detail.field, detail.message);
    } else {
        op->environment.keeps_light = read.turns_alone;
        for (int c = 0; c < 3; c++)
            op->environment.radiance[c] = (double)read.environment.radiance[c];
        memcpy(op->environment.rotation, read.rotation, sizeof read.rotation);
        if (read.environment.map) op->environment.map = bd_sky_map_retain(read.environment.map);
        flag(reading, "environment_negative",
             read.negative_count < UINT32_MAX ? (uint32_t)read.negative_count : UINT32_MAX);
        err = spend_map(reading, read.environment.map);
    }
    bd_net_environment_finish(&read);
    return err;
}

// What the import repaired or shrank.
static void pass_on_flags(const struct reading *reading, const struct bd_scene *scene)
{
    struct bd_edit_flags *flags = reading->flags;
    for (uint32_t i = 0; i < scene->authored_flag_count && flags->count < BD_EDIT_FLAG_MAX; i++)
        snprintf(flags->text[flags->count++], BD_EDIT_FLAG_BYTES, "%s", scene->flags.text[i]);
}

static enum bd_err read_import(const struct reading *reading, const Bounced__ImportEdit *in,
                               struct bd_edit_op *op)
{
    const struct bd_edit_heavy_inputs *inputs = reading->inputs;
    if (in->n_files > inputs->limits->scene_files)
        return refuse(reading, BD_ERR_LIMIT, "files", "has more files than the limit scene_files");
    struct bd_import_files files = {0};
    struct bd_scene *scene = NULL;
    enum bd_err err = bd_import_files_map(&files, inputs->blobs, in->name, in->blob, in->files,
                                          in->n_files, reading->detail);
    struct bd_import_limits limits = bd_import_limits_of(inputs->limits);
    limits.scene_bytes = inputs->budget->bytes;
    limits.picture_texels = inputs->budget->texels;
    if (!err)
        err = bd_import(inputs->import_pool, files.files, files.file_count, &limits, &scene,
                        reading->detail);
    bd_import_files_finish(&files);
    op->import.scene = scene;
    if (!err) pass_on_flags(reading, scene);
    return err ? err : bd_edit_budget_take_scene(inputs->budget, scene, reading->detail);
}

enum bd_err bd_edit_heavy_read(const struct bd_edit_heavy_inputs *inputs, size_t index,
                               const Bounced__EditOp *op, struct bd_edit_op *ops,
                               struct bd_edit_flags *flags, struct bd_err_detail *detail)
{
    const struct reading reading = {inputs, bd_edit_path(index, op), flags, detail};
    switch (op->op_case) {
    case BOUNCED__EDIT_OP__OP_ADD_MESH:
    case BOUNCED__EDIT_OP__OP_SET_MESH:
        return read_mesh(&reading, op->add_mesh, &ops[index]);
    case BOUNCED__EDIT_OP__OP_SET_MESH_VERTICES:
        return read_vertices(&reading, op->set_mesh_vertices, ops, index);
    case BOUNCED__EDIT_OP__OP_ADD_TEXTURE:
    case BOUNCED__EDIT_OP__OP_SET_TEXTURE:
        return read_picture(&reading, op->add_texture->blob, &ops[index]);
    case BOUNCED__EDIT_OP__OP_SET_ENVIRONMENT:
        return read_environment(&reading, op->set_environment, &ops[index]);
    case BOUNCED__EDIT_OP__OP_IMPORT:
        return read_import(&reading, op->import, &ops[index]);
    default:
        return BD_ERR_OK;
    }
}

void bd_edit_heavy_release(struct bd_edit_op *op)
{
    free((void *)op->fields);
    op->fields = NULL;
    switch (op->kind) {
    case BD_EDIT_ADD_MESH:
    case BD_EDIT_SET_MESH:
    case BD_EDIT_SET_MESH_VERTICES:
        bd_mesh_release(&op->mesh.mesh);
        break;
    case BD_EDIT_ADD_TEXTURE:
    case BD_EDIT_SET_TEXTURE:
        bd_picture_release(&op->picture);
        break;
    case BD_EDIT_SET_ENVIRONMENT:
        bd_sky_map_release(&op->environment.map);
        break;
    case BD_EDIT_IMPORT: {
        struct bd_scene *scene = (struct bd_scene *)op->import.scene;
        bd_scene_release(&scene);
        break;
    }
    default:
        break;
    }
}

// --- what it may make of its bytes ---------------------------------------------------------------

#define TEXEL_BYTES 4

struct bd_edit_budget bd_edit_budget(const struct bd_limits *limits, uint64_t quota_bytes)
{
    return (struct bd_edit_budget){
        .bytes = limits->scene_bytes, .texels = limits->picture_texels, .quota_bytes = quota_bytes};
}

static enum bd_err take_quota(struct bd_edit_budget *left, uint64_t bytes,
                              struct bd_err_detail *detail)
{
    if (bytes > left->quota_bytes)
        return bd_err_set(detail, BD_ERR_LIMIT, "max_bytes",
                          "the batch alone would take more than max_bytes");
    left->quota_bytes -= bytes;
    return BD_ERR_OK;
}

enum bd_err bd_edit_budget_hold(struct bd_edit_budget *left, uint64_t bytes, const char *field,
                                struct bd_err_detail *detail)
{
    if (bytes > left->bytes)
        return bd_err_set(detail, BD_ERR_LIMIT, field,
                          "with it the batch is larger than the limit scene_bytes");
    left->bytes -= bytes;
    return BD_ERR_OK;
}

enum bd_err bd_edit_budget_take(struct bd_edit_budget *left, uint64_t bytes, const char *field,
                                struct bd_err_detail *detail)
{
    enum bd_err err = bd_edit_budget_hold(left, bytes, field, detail);
    return err ? err : take_quota(left, bytes, detail);
}

static uint64_t texels_of(const struct bd_picture *picture)
{
    return (uint64_t)picture->width_px * picture->height_px;
}

// A reader's limits are not to the byte what a scene counts for.
static void take_most(uint64_t *left, uint64_t amount)
{
    *left -= amount < *left ? amount : *left;
}

enum bd_err bd_edit_budget_take_picture(struct bd_edit_budget *left,
                                        const struct bd_picture *picture,
                                        struct bd_err_detail *detail)
{
    const uint64_t texels = texels_of(picture);
    take_most(&left->texels, texels);
    return take_quota(left, TEXEL_BYTES * texels, detail);
}

enum bd_err bd_edit_budget_take_scene(struct bd_edit_budget *left, const struct bd_scene *scene,
                                      struct bd_err_detail *detail)
{
    const uint64_t bytes = bd_scene_bytes(scene);
    uint64_t texels = 0;
    for (uint32_t i = 0; i < scene->picture_count; i++) texels += texels_of(scene->pictures[i]);
    take_most(&left->texels, texels);
    take_most(&left->bytes, bytes - TEXEL_BYTES * texels);
    return take_quota(left, bytes, detail);
}
