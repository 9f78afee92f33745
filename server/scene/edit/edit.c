#include "scene/edit/edit.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/edit/edit_parts.h"
#include "scene/model/derive.h"

const struct bd_edit_limits bd_edit_default_limits = {
    .ops = 4096,
    .objects = 1 << 20,
    .triangles = 200000000,
    .steps = 1 << 23, // as many as 4096 nodes need to be hung one below the other
};

// --- errors ---------------------------------------------------------------------------------

void bd_edit_fail(struct bd_edit *edit, enum bd_err err, const char *field, const char *format, ...)
{
    if (edit->err != BD_ERR_OK) return;
    char path[128], message[256];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    snprintf(path, sizeof path, "ops[%u].%s%s%s", edit->op,
             bd_edit_kinds[edit->ops[edit->op].kind].name, field[0] ? "." : "", field);
    edit->err = bd_err_set(edit->detail, err, path, "%s: %s", path, message);
}

void bd_edit_fail_memory(struct bd_edit *edit)
{
    bd_edit_fail(edit, BD_ERR_NO_MEMORY, "", "no memory for the batch");
}

// --- objects --------------------------------------------------------------------------------

void bd_edit_note(struct bd_edit *edit, struct bd_edit_list *list, enum bd_object_kind kind,
                  uint32_t id)
{
    if (list->count == list->room) {
        uint32_t room = list->room ? 2 * list->room : 16;
        struct bd_edit_place *places = realloc(list->places, room * sizeof *places);
        if (!places) {
            bd_edit_fail_memory(edit);
            return;
        }
        list->places = places;
        list->room = room;
    }
    list->places[list->count++] = (struct bd_edit_place){kind, id, edit->op};
}

void bd_edit_touch(struct bd_edit *edit, enum bd_object_kind kind, uint32_t id)
{
    bd_edit_note(edit, &edit->touched, kind, id);
}

uint32_t bd_edit_next(struct bd_edit *edit, enum bd_object_kind kind)
{
    uint32_t id = (*bd_slots_of(&edit->next, kind))++;
    bd_edit_touch(edit, kind, id);
    return id;
}

int32_t bd_edit_above(struct bd_edit *edit, int32_t node)
{
    if (edit->steps++ == edit->limits->steps)
        bd_edit_fail(edit, BD_ERR_LIMIT, "",
                     "the batch's nodes lie too deep: more than %u steps up", edit->limits->steps);
    return edit->err == BD_ERR_OK ? edit->draft->nodes[node].parent : BD_NONE;
}

// A node is gone with any node above it, even before the batch has come to empty its slot. Before
// the batch, all that is below a removed node is removed.
static bool node_is_gone(struct bd_edit *edit, int32_t node)
{
    const struct bd_node *nodes = edit->draft->nodes;
    if (!edit->has_removed_nodes) return nodes[node].is_removed;
    while (node != BD_NONE && !nodes[node].is_removed) node = bd_edit_above(edit, node);
    return node != BD_NONE;
}

static bool is_gone(struct bd_edit *edit, enum bd_object_kind kind, int32_t id)
{
    const struct bd_scene *draft = edit->draft;
    switch (kind) {
    case BD_OBJECT_PICTURE:
        return draft->pictures[id]->is_removed;
    case BD_OBJECT_TEXTURE:
        return draft->textures[id].is_removed;
    case BD_OBJECT_MATERIAL:
        return draft->materials[id].is_removed;
    case BD_OBJECT_LIGHT:
        return draft->lights[id].is_removed;
    case BD_OBJECT_CAMERA:
        return draft->cameras[id].is_removed;
    case BD_OBJECT_MESH:
        return draft->meshes[id]->is_removed;
    case BD_OBJECT_NODE:
        return node_is_gone(edit, id);
    case BD_OBJECT_ENVIRONMENT:
    case BD_OBJECT_KIND_COUNT:
        break;
    }
    return true;
}

static enum bd_object_kind added_by(enum bd_edit_kind kind)
{
    const struct bd_edit_kind_row *row = &bd_edit_kinds[kind];
    return row->does == BD_EDIT_ADDS ? row->object : BD_OBJECT_KIND_COUNT;
}

// The id of what an earlier operation of the batch added.
static int32_t added_id(struct bd_edit *edit, const char *field, enum bd_object_kind kind,
                        int32_t value)
{
    int64_t op = -2 - (int64_t)value;
    if (op < edit->op && added_by(edit->ops[op].kind) == kind) return edit->ids[op];
    bd_edit_fail(edit, BD_ERR_USAGE, field, "%d: no operation before this one adds %s %lld", value,
                 bd_object_kind_name(kind), (long long)op);
    return BD_NONE;
}

int32_t bd_edit_reference(struct bd_edit *edit, const char *field, enum bd_object_kind kind,
                          int32_t value)
{
    if (edit->err != BD_ERR_OK || value == BD_NONE) return BD_NONE;
    int32_t id = value < 0 ? added_id(edit, field, kind, value) : value;
    if (edit->err != BD_ERR_OK) return BD_NONE;
    if ((uint32_t)id >= *bd_slots_of(&edit->next, kind)) {
        bd_edit_fail(edit, BD_ERR_NOT_FOUND, field, "there is no %s %d", bd_object_kind_name(kind),
                     id);
        return BD_NONE;
    }
    if (!is_gone(edit, kind, id)) return id;
    bd_edit_fail(edit, BD_ERR_NOT_FOUND, field, "%s %d was removed", bd_object_kind_name(kind), id);
    return BD_NONE;
}

// The wire's field of the id is the kind's name, in a removal "id".
int32_t bd_edit_target(struct bd_edit *edit, enum bd_object_kind kind)
{
    const struct bd_edit_op *op = &edit->ops[edit->op];
    const bool removes = bd_edit_kinds[op->kind].does == BD_EDIT_REMOVES;
    const char *field = removes ? "id" : bd_object_kind_name(kind);
    int32_t id = bd_edit_reference(edit, field, kind, op->id);
    if (edit->err == BD_ERR_OK && id == BD_NONE)
        bd_edit_fail(edit, BD_ERR_USAGE, field, "names no %s", bd_object_kind_name(kind));
    if (edit->err == BD_ERR_OK) bd_edit_touch(edit, kind, (uint32_t)id);
    return edit->err == BD_ERR_OK ? id : BD_NONE;
}

// --- values ---------------------------------------------------------------------------------

void bd_edit_name(struct bd_edit *edit, const char *name, char out[64])
{
    size_t length = strlen(name);
    if (length > 63) {
        bd_edit_fail(edit, BD_ERR_LIMIT, "name", "%zu bytes, limit 63", length);
        return;
    }
    memset(out, 0, 64);
    memcpy(out, name, length);
}

void bd_edit_numbers(struct bd_edit *edit, const struct bd_object_field *row, const double *values,
                     size_t count, float *out)
{
    if (count != row->count) {
        bd_edit_fail(edit, BD_ERR_USAGE, row->name, "takes %u numbers", row->count);
        return;
    }
    for (size_t i = 0; i < count; i++)
        if (bd_field_takes(row, values[i]))
            out[i] = bd_field_kept(row, values[i]);
        else
            bd_edit_fail(edit, BD_ERR_USAGE, row->name, "%.9g is not in [%.9g, %.9g]", values[i],
                         row->least, row->most);
}

static void set_word(struct bd_edit *edit, const struct bd_object_field *row, const char *text,
                     void *out)
{
    char takes[BD_FIELD_TAKES_BYTES];
    for (int word = 0; row->words[word]; word++)
        if (strcmp(row->words[word], text) == 0) {
            memcpy(out, &word, sizeof word);
            return;
        }
    bd_edit_fail(edit, BD_ERR_USAGE, row->name, "is one of %s", bd_field_takes_text(row, takes));
}

static void set_map(struct bd_edit *edit, const struct bd_object_field *row, int32_t value,
                    struct bd_texture_ref *out)
{
    const int32_t id = bd_edit_reference(edit, row->name, row->refers_to, value);
    if (out->texture == BD_NONE || id == BD_NONE) *out = bd_texture_ref_none;
    out->texture = id;
}

void bd_edit_field(struct bd_edit *edit, const struct bd_object_field *row,
                   const struct bd_field_value *value, void *object)
{
    void *const at = bd_field_of(row, object);
    switch (row->type) {
    case BD_FIELD_NAME:
        bd_edit_name(edit, value->text, at);
        break;
    case BD_FIELD_SWITCH:
        *(bool *)at = (value->whole != 0) != row->inverted;
        break;
    case BD_FIELD_NUMBERS:
        bd_edit_numbers(edit, row, value->numbers, value->count, at);
        break;
    case BD_FIELD_WORD:
        set_word(edit, row, value->text, at);
        break;
    case BD_FIELD_OBJECT:
        *(int32_t *)at = bd_edit_reference(edit, row->name, row->refers_to, value->whole);
        break;
    case BD_FIELD_MAP:
        set_map(edit, row, value->whole, at);
        break;
    case BD_FIELD_HEAVY:
        break;
    }
}

const struct bd_field_value *bd_edit_given(const struct bd_edit_op *op, const char *name)
{
    for (size_t i = 0; i < op->field_count; i++)
        if (strcmp(op->fields[i].name, name) == 0) return &op->fields[i];
    return NULL;
}

// In the order of the rows: what an object is comes before what it then has.
void bd_edit_fields(struct bd_edit *edit, const struct bd_edit_op *op, enum bd_object_kind kind,
                    const char *but, void *object)
{
    const struct bd_object_field_list list = bd_object_fields(kind);
    for (uint32_t i = 0; i < list.count; i++) {
        if (but && strcmp(list.rows[i].name, but) == 0) continue;
        const struct bd_field_value *value = bd_edit_given(op, list.rows[i].name);
        if (value && bd_field_holds(&list.rows[i], object))
            bd_edit_field(edit, &list.rows[i], value, object);
    }
}

// --- the batch ------------------------------------------------------------------------------

static void carry_out(struct bd_edit *edit, const struct bd_edit_op *op)
{
    static void (*const carry[BD_OBJECT_KIND_COUNT])(struct bd_edit *,
                                                     const struct bd_edit_op *) = {
        [BD_OBJECT_TEXTURE] = bd_edit_texture,
        [BD_OBJECT_MATERIAL] = bd_edit_material,
        [BD_OBJECT_LIGHT] = bd_edit_light,
        [BD_OBJECT_CAMERA] = bd_edit_camera,
        [BD_OBJECT_MESH] = bd_edit_mesh,
        [BD_OBJECT_NODE] = bd_edit_node,
        [BD_OBJECT_ENVIRONMENT] = bd_edit_environment,
    };
    const struct bd_edit_kind_row *row = &bd_edit_kinds[op->kind];
    if (row->does == BD_EDIT_REMOVES)
        bd_edit_remove(edit, row->object);
    else if (op->kind == BD_EDIT_IMPORT)
        bd_edit_import(edit, op);
    else
        carry[row->object](edit, op);
}

// Room for all that the batch may add: a picture comes with a texture, a white material with
// meshes, and an import with all it has and a node for each mesh that lies in world space.
static void count_room(const struct bd_edit_op *op, struct bd_scene_counts *room)
{
    enum bd_object_kind added = added_by(op->kind);
    if (added != BD_OBJECT_KIND_COUNT) ++*bd_slots_of(room, added);
    room->pictures += op->kind == BD_EDIT_ADD_TEXTURE || op->kind == BD_EDIT_SET_TEXTURE;
    room->materials += op->kind == BD_EDIT_ADD_MESH || op->kind == BD_EDIT_SET_MESH;
    if (op->kind != BD_EDIT_IMPORT) return;
    const struct bd_scene_counts more = bd_scene_slots(op->import.scene);
    room->nodes += 2 * more.nodes;
    room->meshes += more.meshes;
    room->materials += more.materials;
    room->textures += more.textures;
    room->pictures += more.pictures;
    room->lights += more.lights;
    room->cameras += more.cameras;
}

static bool begin(struct bd_edit *edit, const struct bd_scene *base, uint32_t op_count)
{
    edit->next = bd_scene_slots(base);
    struct bd_scene_counts room = edit->next;
    for (uint32_t i = 0; i < op_count; i++) count_room(&edit->ops[i], &room);
    edit->draft = bd_scene_copy(base, &room);
    edit->ids = malloc((op_count + (size_t)1) * sizeof *edit->ids);
    if (edit->draft && edit->ids) return true;
    edit->err = bd_err_set(edit->detail, BD_ERR_NO_MEMORY, "ops", "no memory for the batch");
    return false;
}

static void check_slots(struct bd_edit *edit)
{
    for (int kind = 0; kind < BD_OBJECT_ENVIRONMENT; kind++) {
        const char *name = bd_object_kind_name((enum bd_object_kind)kind);
        uint32_t count = *bd_slots_of(&edit->next, (enum bd_object_kind)kind);
        if (count > edit->limits->objects)
            bd_edit_fail(edit, BD_ERR_LIMIT, "", "%u slots of kind %s, limit %u", count, name,
                         edit->limits->objects);
    }
}

static uint64_t triangles_of(const struct bd_mesh *mesh)
{
    uint64_t count = 0;
    for (uint32_t p = 0; p < mesh->primitive_count; p++)
        count += mesh->primitives[p].index_count / 3;
    return count;
}

static void check_triangles(struct bd_edit *edit)
{
    const struct bd_scene *draft = edit->draft;
    uint64_t count = 0;
    for (uint32_t i = 0; i < edit->next.nodes; i++)
        if (draft->nodes[i].mesh != BD_NONE)
            count += triangles_of(draft->meshes[draft->nodes[i].mesh]);
    if (count > edit->limits->triangles)
        bd_edit_fail(edit, BD_ERR_LIMIT, "", "%llu triangles, limit %llu",
                     (unsigned long long)count, (unsigned long long)edit->limits->triangles);
}

static int compare_places(const void *a, const void *b)
{
    const struct bd_edit_place *left = a, *right = b;
    if (left->kind != right->kind) return left->kind < right->kind ? -1 : 1;
    return (left->id > right->id) - (left->id < right->id);
}

// In order, so that each is put at the end.
static void take_touched(struct bd_edit *edit, struct bd_delta *out)
{
    struct bd_edit_list *touched = &edit->touched;
    if (touched->count)
        qsort(touched->places, touched->count, sizeof *touched->places, compare_places);
    for (uint32_t i = 0; i < touched->count && edit->err == BD_ERR_OK; i++) {
        const struct bd_edit_place *place = &touched->places[i];
        if (i > 0 && compare_places(place, place - 1) == 0) continue;
        if (!bd_delta_take(out, edit->draft, place->kind, place->id)) bd_edit_fail_memory(edit);
    }
}

static void run(struct bd_edit *edit, uint32_t op_count, struct bd_delta *out)
{
    for (uint32_t i = 0; i < op_count && edit->err == BD_ERR_OK; i++) {
        edit->op = i;
        edit->ids[i] = BD_NONE;
        carry_out(edit, &edit->ops[i]);
        if (edit->err == BD_ERR_OK) check_slots(edit);
    }
    if (edit->err == BD_ERR_OK) bd_edit_settle_removals(edit);
    if (edit->err == BD_ERR_OK) check_triangles(edit);
    if (edit->err == BD_ERR_OK) take_touched(edit, out);
}

enum bd_err bd_edit_check(const struct bd_scene *base, const struct bd_edit_op *ops,
                          uint32_t op_count, const struct bd_edit_limits *limits,
                          struct bd_delta *out, int32_t *ids, struct bd_err_detail *detail)
{
    struct bd_edit edit = {.ops = ops, .limits = limits, .detail = detail, .white = BD_NONE};
    *out = (struct bd_delta){0};
    if (op_count == 0) return bd_err_set(detail, BD_ERR_USAGE, "ops", "ops: there are none");
    if (op_count > limits->ops)
        return bd_err_set(detail, BD_ERR_LIMIT, "ops", "ops: %u operations, limit %u", op_count,
                          limits->ops);
    if (begin(&edit, base, op_count)) run(&edit, op_count, out);
    if (edit.err == BD_ERR_OK && ids) memcpy(ids, edit.ids, op_count * sizeof *ids);
    if (edit.err != BD_ERR_OK) bd_delta_finish(out);
    free(edit.ids);
    free(edit.picture_users);
    free(edit.touched.places);
    free(edit.removed.places);
    bd_scene_release(&edit.draft);
    return edit.err;
}
