#include "net/http/http_commands.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "protocol/field_text.h"
#include "protocol/json.h"
#include "protocol/wire.h"

// --- paths ----------------------------------------------------------------------------------

static const char *path_of(const struct bd_command_row *row)
{
    return strchr(row->http, ' ') + 1;
}

// "ID" stands for what is up to the next slash.
static bool matches(const char *pattern, const char *path, char *id, size_t id_bytes)
{
    while (*pattern) {
        if (strncmp(pattern, "ID", 2) != 0) {
            if (*pattern++ != *path++) return false;
            continue;
        }
        const size_t length = strcspn(path, "/");
        if (length == 0 || length >= id_bytes) return false;
        memcpy(id, path, length);
        id[length] = 0;
        path += length;
        pattern += 2;
    }
    return !*path;
}

const struct bd_command_row *bd_http_command_find(const char *path, char *id, size_t id_bytes)
{
    const struct bd_command_row *row;
    for (uint32_t i = 0; (row = bd_command_row_at(i)); i++)
        if (row->http && matches(path_of(row), path, id, id_bytes)) return row;
    return NULL;
}

static bool is_by(const struct bd_command_row *row, enum bd_http_method method)
{
    static const char *const words[] = {
        [BD_HTTP_GET] = "GET ", [BD_HTTP_HEAD] = "HEAD ",     [BD_HTTP_POST] = "POST ",
        [BD_HTTP_PUT] = "PUT ", [BD_HTTP_DELETE] = "DELETE ",
    };
    return strncmp(row->http, words[method], strlen(words[method])) == 0;
}

const struct bd_command_row *bd_http_command_by(const struct bd_command_row *first,
                                                enum bd_http_method method)
{
    const struct bd_command_row *row;
    for (uint32_t i = 0; (row = bd_command_row_at(i)); i++)
        if (row->http && strcmp(path_of(row), path_of(first)) == 0 && is_by(row, method))
            return row;
    return NULL;
}

// --- queries --------------------------------------------------------------------------------

static ProtobufCMessage *new_message(const ProtobufCMessageDescriptor *descriptor)
{
    ProtobufCMessage *message = malloc(descriptor->sizeof_message);
    BD_ASSERT(message);
    protobuf_c_message_init(descriptor, message);
    return message;
}

// A field by its name, but for the scene, which the path says.
static bool take_pair(const struct bd_command_row *row, ProtobufCMessage *message, const char *name,
                      char *value)
{
    const ProtobufCFieldDescriptor *field =
        protobuf_c_message_descriptor_get_field_by_name(message->descriptor, name);
    if (!field || !value || (row->scene && strcmp(name, row->scene) == 0)) return false;
    return bd_http_query_decode(value) && bd_field_set_text(message, field, value);
}

static enum bd_err read_query(const char *query, const struct bd_command_row *row,
                              ProtobufCMessage **out, struct bd_fault *fault)
{
    char *copy = bd_answer_text(query), *rest = NULL;
    enum bd_err err = BD_ERR_OK;
    *out = new_message(bd_command_message(row));
    for (char *pair = strtok_r(copy, "&", &rest); pair && !err; pair = strtok_r(NULL, "&", &rest)) {
        char *value = strchr(pair, '=');
        if (value) *value++ = 0;
        if (!take_pair(row, *out, pair, value))
            err = bd_fault_set(fault, BD_ERR_USAGE, pair,
                               "\"%.40s\" is no option of this request, or its value makes no "
                               "sense",
                               pair);
    }
    free(copy);
    if (err) protobuf_c_message_free_unpacked(*out, NULL);
    return err;
}

// --- bodies ---------------------------------------------------------------------------------

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

static enum bd_err read_json(const struct bd_http *http, const struct bd_command_row *row,
                             ProtobufCMessage **out, struct bd_fault *fault)
{
    json_error_t error;
    // Where the path says what it is about, there may be nothing more to say.
    const bool is_empty = http->body_bytes == 0 && row->scene;
    json_t *json = json_loadb(is_empty ? "{}" : (const char *)http->body,
                              is_empty ? 2 : http->body_bytes, JSON_REJECT_DUPLICATES, &error);
    if (!json)
        return bd_fault_set(fault, BD_ERR_BAD_INPUT, "body", "line %d of the body: %s", error.line,
                            error.text);
    const bool has_ops = row->body == BOUNCED__ENVELOPE__BODY_EDIT_BATCH;
    enum bd_err err = has_ops ? check_ops(json, fault) : BD_ERR_OK;
    if (!err) err = bd_json_to_message(json, bd_command_message(row), out, fault);
    json_decref(json);
    return err;
}

static enum bd_err read_protobuf(const struct bd_http *http, const struct bd_command_row *row,
                                 ProtobufCMessage **out, struct bd_fault *fault)
{
    struct bd_wire_alloc alloc;
    bd_wire_alloc_init(&alloc, bd_wire_budget(http->body_bytes));
    *out = protobuf_c_message_unpack(bd_command_message(row), &alloc.allocator, http->body_bytes,
                                     http->body);
    if (!*out)
        return bd_fault_set(fault, BD_ERR_BAD_INPUT, "body", "the body is no %s",
                            bd_command_message(row)->short_name);
    enum bd_err err =
        bd_wire_check_text(bd_command_message(row), http->body, http->body_bytes, fault);
    if (err) protobuf_c_message_free_unpacked(*out, NULL);
    return err;
}

// The scene is the path's, whatever the body says.
static void set_scene(ProtobufCMessage *message, const char *name, const char *id)
{
    const ProtobufCFieldDescriptor *field =
        protobuf_c_message_descriptor_get_field_by_name(message->descriptor, name);
    const bool is_set = bd_field_set_text(message, field, id);
    BD_ASSERT(is_set);
}

enum bd_err bd_http_command_read(const struct bd_http *http, const struct bd_command_row *row,
                                 struct bd_answer *out, struct bd_fault *fault)
{
    const char *type = http->head.values[BD_HTTP_CONTENT_TYPE];
    ProtobufCMessage *message = NULL;
    enum bd_err err;
    if (http->method != BD_HTTP_POST)
        err = read_query(http->target.query, row, &message, fault);
    else if (bd_http_media_is(type, "application/json"))
        err = read_json(http, row, &message, fault);
    else
        err = read_protobuf(http, row, &message, fault);
    if (err) return err;
    if (row->scene) set_scene(message, row->scene, http->target.id);
    *out = bd_answer_of(row->body, message);
    return BD_ERR_OK;
}
