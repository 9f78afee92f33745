#include "clients/cli/json_names.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "protocol/bounced.pb-c.h"

struct walk {
    char path[128];
    struct bd_fault *fault;
};

static enum bd_err check_object(struct walk *walk, const json_t *json,
                                const ProtobufCMessageDescriptor *descriptor);

// Appends to the path; what does not fit is cut off. Returns the length to go back to.
static size_t push(struct walk *walk, const char *name, size_t index, bool is_index)
{
    size_t length = strlen(walk->path), room = sizeof walk->path - length;
    if (is_index)
        snprintf(walk->path + length, room, "[%zu]", index);
    else
        snprintf(walk->path + length, room, "%s%s", length ? "." : "", name);
    return length;
}

// The message that a field holds, NULL for numbers and texts, and for tables: their keys are the
// user's.
static const ProtobufCMessageDescriptor *message_of(const ProtobufCFieldDescriptor *field)
{
    if (field->type != PROTOBUF_C_TYPE_MESSAGE) return NULL;
    const ProtobufCMessageDescriptor *descriptor = field->descriptor;
    return descriptor == &bounced__key_value__descriptor ? NULL : descriptor;
}

static enum bd_err check_items(struct walk *walk, const json_t *items,
                               const ProtobufCMessageDescriptor *descriptor)
{
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < json_array_size(items); i++) {
        size_t length = push(walk, NULL, i, true);
        err = check_object(walk, json_array_get(items, i), descriptor);
        walk->path[length] = 0;
    }
    return err;
}

static enum bd_err check_field(struct walk *walk, const char *name, const json_t *value,
                               const ProtobufCMessageDescriptor *descriptor)
{
    const ProtobufCFieldDescriptor *field =
        protobuf_c_message_descriptor_get_field_by_name(descriptor, name);
    size_t length = push(walk, name, 0, false);
    if (!field)
        return bd_fault_set(walk->fault, BD_ERR_USAGE, walk->path, "%s: there is no such name",
                            walk->path);
    const ProtobufCMessageDescriptor *inner = message_of(field);
    enum bd_err err = BD_ERR_OK;
    if (inner && json_is_array(value)) err = check_items(walk, value, inner);
    if (inner && json_is_object(value)) err = check_object(walk, value, inner);
    walk->path[length] = 0;
    return err;
}

static enum bd_err check_object(struct walk *walk, const json_t *json,
                                const ProtobufCMessageDescriptor *descriptor)
{
    const char *name;
    json_t *value;
    json_object_foreach((json_t *)json, name, value)
    {
        enum bd_err err = check_field(walk, name, value, descriptor);
        if (err) return err;
    }
    return BD_ERR_OK;
}

enum bd_err bd_cli_check_json_names(const json_t *json,
                                    const ProtobufCMessageDescriptor *descriptor,
                                    struct bd_fault *fault)
{
    struct walk walk = {.fault = fault};
    return check_object(&walk, json, descriptor);
}
