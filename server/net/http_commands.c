#include "net/http_edits.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "protocol/json.h"
#include "protocol/wire.h"

static const struct {
    const char *word;
    Bounced__Envelope__BodyCase body;
    const ProtobufCMessageDescriptor *descriptor;
} edits[BD_HTTP_EDIT_COUNT] = {
    {"edits", BOUNCED__ENVELOPE__BODY_EDIT_BATCH, &bounced__edit_batch__descriptor},
    {"undo", BOUNCED__ENVELOPE__BODY_EDIT_UNDO, &bounced__edit_undo__descriptor},
    {"revert", BOUNCED__ENVELOPE__BODY_EDIT_REVERT, &bounced__edit_revert__descriptor},
    {"commit", BOUNCED__ENVELOPE__BODY_EDIT_COMMIT, &bounced__edit_commit__descriptor},
    {"names", BOUNCED__ENVELOPE__BODY_REVISION_NAME, &bounced__revision_name__descriptor},
    {"log", BOUNCED__ENVELOPE__BODY_SCENE_LOG, &bounced__scene_log__descriptor},
    {"export", BOUNCED__ENVELOPE__BODY_SCENE_EXPORT, &bounced__scene_export__descriptor},
};

enum bd_http_edit bd_http_edit_find(const char *word)
{
    int edit = 0;
    while (edit < BD_HTTP_EDIT_COUNT && strcmp(edits[edit].word, word) != 0) edit++;
    return (enum bd_http_edit)edit;
}

bool bd_http_edit_is_get(enum bd_http_edit edit)
{
    return edit == BD_HTTP_EDIT_LOG || edit == BD_HTTP_EDIT_EXPORT;
}

// --- operations by name ---------------------------------------------------------------------

static enum bd_err check_op(size_t index, const json_t *op, struct bd_fault *fault)
{
    char path[32];
    if (json_is_object(op) && json_object_size(op) == 1) return BD_ERR_OK;
    snprintf(path, sizeof path, "ops[%zu]", index);
    return bd_fault_set(fault, BD_ERR_USAGE, path,
                        "an operation is an object with one name: {\"set_light\": {...}}");
}

static enum bd_err check_ops(const json_t *json, struct bd_fault *fault)
{
    const json_t *ops = json_object_get(json, "ops");
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < json_array_size(ops); i++)
        err = check_op(i, json_array_get(ops, i), fault);
    return err;
}

// --- bodies ---------------------------------------------------------------------------------

static enum bd_err read_json(const struct bd_http *http, enum bd_http_edit edit,
                             ProtobufCMessage **out, struct bd_fault *fault)
{
    json_error_t error;
    const char *body = http->body_bytes ? (const char *)http->body : "{}";
    const size_t size = http->body_bytes ? http->body_bytes : 2;
    json_t *json = json_loadb(body, size, JSON_REJECT_DUPLICATES, &error);
    if (!json)
        return bd_fault_set(fault, BD_ERR_BAD_INPUT, "body", "line %d of the body: %s", error.line,
                            error.text);
    enum bd_err err = edit == BD_HTTP_EDIT_EDITS ? check_ops(json, fault) : BD_ERR_OK;
    if (!err) err = bd_json_to_message(json, edits[edit].descriptor, out, fault);
    json_decref(json);
    return err;
}

static enum bd_err read_protobuf(const struct bd_http *http, enum bd_http_edit edit,
                                 ProtobufCMessage **out, struct bd_fault *fault)
{
    struct bd_wire_alloc alloc;
    bd_wire_alloc_init(&alloc, bd_wire_budget(http->body_bytes));
    *out = protobuf_c_message_unpack(edits[edit].descriptor, &alloc.allocator, http->body_bytes,
                                     http->body);
    if (*out) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_BAD_INPUT, "body", "the body is no %s",
                        edits[edit].descriptor->short_name);
}

// The scene is the path's, whatever the body says.
static void set_scene(ProtobufCMessage *message, const char *id)
{
    const ProtobufCFieldDescriptor *field =
        protobuf_c_message_descriptor_get_field_by_name(message->descriptor, "scene");
    char **scene = (char **)((uint8_t *)message + field->offset);
    free(*scene);
    *scene = bd_answer_text(id);
}

// --- queries --------------------------------------------------------------------------------

// Calls `take` for each pair of the query; the first that it does not take is refused by name.
static enum bd_err read_pairs(const char *query, bool (*take)(void *user, char *key, char *value),
                              void *user, struct bd_fault *fault)
{
    char *copy = bd_answer_text(query), *rest = NULL;
    enum bd_err err = BD_ERR_OK;
    for (char *pair = strtok_r(copy, "&", &rest); pair && !err; pair = strtok_r(NULL, "&", &rest)) {
        char *value = strchr(pair, '=');
        if (value) *value++ = 0;
        if (!value || !take(user, pair, value))
            err = bd_fault_set(fault, BD_ERR_USAGE, pair,
                               "\"%.40s\" is no option of this request, or its value makes no "
                               "sense",
                               pair);
    }
    free(copy);
    return err;
}

static bool take_log_pair(void *user, char *key, char *value)
{
    Bounced__SceneLog *log = user;
    uint64_t number;
    if (!bd_http_query_number(value, UINT64_MAX, &number)) return false;
    if (strcmp(key, "after") == 0) {
        BD_SET(log, after, number);
        return true;
    }
    if (strcmp(key, "limit") != 0 || number > UINT32_MAX) return false;
    BD_SET(log, limit, (uint32_t)number);
    return true;
}

static enum bd_err read_log(const struct bd_http *http, ProtobufCMessage **out,
                            struct bd_fault *fault)
{
    Bounced__SceneLog *log = malloc(sizeof *log);
    BD_ASSERT(log);
    bounced__scene_log__init(log);
    *out = &log->base;
    enum bd_err err = read_pairs(http->target.query, take_log_pair, log, fault);
    if (err) protobuf_c_message_free_unpacked(*out, NULL);
    return err;
}

static bool take_export_pair(void *user, char *key, char *value)
{
    Bounced__SceneExport *request = user;
    uint64_t number;
    if (strcmp(key, "name") == 0 && !request->name) {
        if (!bd_http_query_decode(value)) return false;
        request->name = bd_answer_text(value);
        return true;
    }
    if (strcmp(key, "revision") != 0 || !bd_http_query_number(value, UINT64_MAX, &number))
        return false;
    BD_SET(request, revision, number);
    return true;
}

static enum bd_err read_export(const struct bd_http *http, ProtobufCMessage **out,
                               struct bd_fault *fault)
{
    Bounced__SceneExport *request = malloc(sizeof *request);
    BD_ASSERT(request);
    bounced__scene_export__init(request);
    *out = &request->base;
    enum bd_err err = read_pairs(http->target.query, take_export_pair, request, fault);
    if (err) protobuf_c_message_free_unpacked(*out, NULL);
    return err;
}

static bool take_scene_pair(void *user, char *key, char *value)
{
    if (strcmp(key, "objects") != 0 || value[0] == 0 || value[1] != 0) return false;
    *(bool *)user = value[0] == '1';
    return value[0] == '0' || value[0] == '1';
}

enum bd_err bd_http_scene_query(const char *query, bool *objects, struct bd_fault *fault)
{
    *objects = false;
    return read_pairs(query, take_scene_pair, objects, fault);
}

enum bd_err bd_http_edit_read(const struct bd_http *http, struct bd_answer *out,
                              struct bd_fault *fault)
{
    const enum bd_http_edit edit = http->target.edit;
    const char *type = http->head.values[BD_HTTP_CONTENT_TYPE];
    ProtobufCMessage *message = NULL;
    enum bd_err err;
    if (edit == BD_HTTP_EDIT_LOG)
        err = read_log(http, &message, fault);
    else if (edit == BD_HTTP_EDIT_EXPORT)
        err = read_export(http, &message, fault);
    else if (bd_http_media_is(type, "application/json"))
        err = read_json(http, edit, &message, fault);
    else
        err = read_protobuf(http, edit, &message, fault);
    if (err) return err;
    set_scene(message, http->target.id);
    *out = bd_answer_of(edits[edit].body, message);
    return BD_ERR_OK;
}
