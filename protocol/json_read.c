// JSON read into messages, by the schema; an error names the path to what is wrong.

#include "protocol/json.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/nearest.h"
#include "protocol/json_internal.h"

// Where we are, "frame.size[1]", kept while walking down and cut back while walking up.
struct reader {
    char path[128];
    struct bd_err_detail *detail;
};

static size_t path_push(struct reader *reader, const char *format, ...) BD_PRINTF(2, 3);
static size_t path_push(struct reader *reader, const char *format, ...)
{
    size_t length = strlen(reader->path);
    va_list args;
    va_start(args, format);
    vsnprintf(reader->path + length, sizeof reader->path - length, format, args);
    va_end(args);
    return length;
}

static void path_pop(struct reader *reader, size_t length)
{
    reader->path[length] = 0;
}

static const char *json_type_name(const json_t *json)
{
    switch (json_typeof(json)) {
    case JSON_OBJECT:
        return "an object";
    case JSON_ARRAY:
        return "an array";
    case JSON_STRING:
        return "a string";
    case JSON_INTEGER:
    case JSON_REAL:
        return "a number";
    case JSON_TRUE:
    case JSON_FALSE:
        return "a boolean";
    case JSON_NULL:
        return "null";
    }
    return "nothing";
}

static enum bd_err refuse(struct reader *reader, const json_t *json, const char *wanted)
{
    return bd_err_set(reader->detail, BD_ERR_BAD_INPUT, reader->path, "%s is %s where %s is due",
                      reader->path[0] ? reader->path : "the body", json_type_name(json), wanted);
}

static enum bd_err refuse_memory(struct reader *reader)
{
    return bd_err_set(reader->detail, BD_ERR_NO_MEMORY, reader->path, "no memory for the request");
}

static bool all_digits(const char *text)
{
    return *text && strspn(text, "0123456789") == strlen(text);
}

// 64-bit numbers may come as decimal strings, as we write the large ones.
static bool u64_from_json(const json_t *json, uint64_t most, uint64_t *out)
{
    if (json_is_integer(json) && json_integer_value(json) >= 0) {
        *out = (uint64_t)json_integer_value(json);
    } else if (json_is_string(json) && most == UINT64_MAX && all_digits(json_string_value(json))) {
        errno = 0;
        *out = strtoull(json_string_value(json), NULL, 10);
        if (errno) return false;
    } else {
        return false;
    }
    return *out <= most;
}

static bool i64_from_json(const json_t *json, int64_t least, int64_t most, int64_t *out)
{
    if (!json_is_integer(json)) return false;
    *out = json_integer_value(json);
    return *out >= least && *out <= most;
}

static enum bd_err read_unsigned(struct reader *reader, const json_t *json, size_t size,
                                 void *element)
{
    uint64_t value;
    if (!u64_from_json(json, size == 4 ? UINT32_MAX : UINT64_MAX, &value))
        return refuse(reader, json,
                      size == 4 ? "a whole number from 0 to 4294967295"
                                : "a whole number from 0 to 2^64 - 1");
    uint32_t narrow = (uint32_t)value;
    memcpy(element, size == 4 ? (const void *)&narrow : (const void *)&value, size);
    return BD_ERR_OK;
}

static enum bd_err read_signed(struct reader *reader, const json_t *json, size_t size,
                               void *element)
{
    int64_t value;
    if (!i64_from_json(json, size == 4 ? INT32_MIN : INT64_MIN, size == 4 ? INT32_MAX : INT64_MAX,
                       &value))
        return refuse(reader, json, "a whole number");
    int32_t narrow = (int32_t)value;
    memcpy(element, size == 4 ? (const void *)&narrow : (const void *)&value, size);
    return BD_ERR_OK;
}

static enum bd_err read_real(struct reader *reader, const json_t *json, size_t size, void *element)
{
    if (!json_is_number(json)) return refuse(reader, json, "a number");
    double value = json_number_value(json);
    float narrow = (float)value;
    if (size == 4 && !isfinite(narrow)) return refuse(reader, json, "a number that fits a float");
    memcpy(element, size == 4 ? (const void *)&narrow : (const void *)&value, size);
    return BD_ERR_OK;
}

static enum bd_err read_string(struct reader *reader, const json_t *json, char **out)
{
    if (!json_is_string(json)) return refuse(reader, json, "a string");
    *out = strdup(json_string_value(json));
    return *out ? BD_ERR_OK : refuse_memory(reader);
}

static enum bd_err read_message(struct reader *reader, const json_t *json,
                                const ProtobufCMessageDescriptor *descriptor,
                                ProtobufCMessage **out);

static enum bd_err read_element(struct reader *reader, const json_t *json,
                                const ProtobufCFieldDescriptor *field, void *element)
{
    size_t size = bd_json_element_size(field->type);
    switch (field->type) {
    case PROTOBUF_C_TYPE_INT32:
    case PROTOBUF_C_TYPE_SINT32:
    case PROTOBUF_C_TYPE_SFIXED32:
    case PROTOBUF_C_TYPE_INT64:
    case PROTOBUF_C_TYPE_SINT64:
    case PROTOBUF_C_TYPE_SFIXED64:
    case PROTOBUF_C_TYPE_ENUM:
        return read_signed(reader, json, size, element);
    case PROTOBUF_C_TYPE_UINT32:
    case PROTOBUF_C_TYPE_FIXED32:
    case PROTOBUF_C_TYPE_UINT64:
    case PROTOBUF_C_TYPE_FIXED64:
        return read_unsigned(reader, json, size, element);
    case PROTOBUF_C_TYPE_FLOAT:
    case PROTOBUF_C_TYPE_DOUBLE:
        return read_real(reader, json, size, element);
    case PROTOBUF_C_TYPE_BOOL:
        if (!json_is_boolean(json)) return refuse(reader, json, "true or false");
        *(protobuf_c_boolean *)element = json_is_true(json);
        return BD_ERR_OK;
    case PROTOBUF_C_TYPE_STRING:
        return read_string(reader, json, element);
    case PROTOBUF_C_TYPE_MESSAGE:
        return read_message(reader, json, field->descriptor, element);
    case PROTOBUF_C_TYPE_BYTES:
        break; // the schema has none
    }
    return refuse(reader, json, "nothing");
}

// Makes room for `count` zeroed elements and hangs them into the message at once, so that freeing
// the message frees what was read before an error. The count grows with each element read.
static enum bd_err begin_repeated(struct reader *reader, ProtobufCMessage *message,
                                  const ProtobufCFieldDescriptor *field, size_t count,
                                  char **elements, size_t **used)
{
    char *base = (char *)message;
    *used = (size_t *)(void *)(base + field->quantifier_offset);
    *elements = count ? calloc(count, bd_json_element_size(field->type)) : NULL;
    if (count && !*elements) return refuse_memory(reader);
    memcpy(base + field->offset, elements, sizeof *elements);
    return BD_ERR_OK;
}

static enum bd_err read_array(struct reader *reader, const json_t *json,
                              const ProtobufCFieldDescriptor *field, ProtobufCMessage *message)
{
    if (!json_is_array(json)) return refuse(reader, json, "an array");
    char *elements;
    size_t *used;
    enum bd_err err =
        begin_repeated(reader, message, field, json_array_size(json), &elements, &used);
    for (size_t i = 0; !err && i < json_array_size(json); i++) {
        size_t cut = path_push(reader, "[%zu]", i);
        err = read_element(reader, json_array_get(json, i), field,
                           elements + i * bd_json_element_size(field->type));
        if (!err) ++*used;
        path_pop(reader, cut);
    }
    return err;
}

static enum bd_err read_pair(struct reader *reader, const char *key, json_t *json,
                             Bounced__KeyValue **out)
{
    if (!json_is_string(json) && !json_is_number(json))
        return refuse(reader, json, "a string or a number");
    Bounced__KeyValue *pair = malloc(sizeof *pair);
    if (!pair) return refuse_memory(reader);
    bounced__key_value__init(pair);
    pair->key = strdup(key);
    pair->value = json_is_string(json)
                      ? strdup(json_string_value(json))
                      : json_dumps(json, JSON_ENCODE_ANY | JSON_REAL_PRECISION(15));
    *out = pair;
    if (pair->key && pair->value) return BD_ERR_OK;
    bounced__key_value__free_unpacked(pair, NULL);
    return refuse_memory(reader);
}

static enum bd_err read_table(struct reader *reader, json_t *json,
                              const ProtobufCFieldDescriptor *field, ProtobufCMessage *message)
{
    if (!json_is_object(json)) return refuse(reader, json, "an object");
    char *elements;
    size_t *used;
    enum bd_err err =
        begin_repeated(reader, message, field, json_object_size(json), &elements, &used);
    Bounced__KeyValue **pairs = (Bounced__KeyValue **)(void *)elements;
    for (void *at = json_object_iter(json); !err && at; at = json_object_iter_next(json, at)) {
        size_t cut = path_push(reader, ".%s", json_object_iter_key(at));
        err =
            read_pair(reader, json_object_iter_key(at), json_object_iter_value(at), &pairs[*used]);
        if (!err) ++*used;
        path_pop(reader, cut);
    }
    return err;
}

static void mark_set(ProtobufCMessage *message, const ProtobufCFieldDescriptor *field)
{
    char *base = (char *)message;
    if (field->flags & PROTOBUF_C_FIELD_FLAG_ONEOF)
        *(uint32_t *)(void *)(base + field->quantifier_offset) = field->id;
    else if (field->label == PROTOBUF_C_LABEL_OPTIONAL && field->type != PROTOBUF_C_TYPE_STRING &&
             field->type != PROTOBUF_C_TYPE_MESSAGE)
        *(protobuf_c_boolean *)(base + field->quantifier_offset) = 1;
}

static bool oneof_is_taken(const ProtobufCMessage *message, const ProtobufCFieldDescriptor *field)
{
    return (field->flags & PROTOBUF_C_FIELD_FLAG_ONEOF) &&
           *(const uint32_t *)(const void *)((const char *)message + field->quantifier_offset) != 0;
}

static enum bd_err read_field(struct reader *reader, json_t *json,
                              const ProtobufCFieldDescriptor *field, ProtobufCMessage *message)
{
    if (bd_json_is_table(field)) return read_table(reader, json, field, message);
    if (field->label == PROTOBUF_C_LABEL_REPEATED) return read_array(reader, json, field, message);
    if (json_is_null(json)) return BD_ERR_OK; // null is "not set"
    if (oneof_is_taken(message, field)) return refuse(reader, json, "only one of its siblings");
    enum bd_err err = read_element(reader, json, field, (char *)message + field->offset);
    if (!err) mark_set(message, field);
    return err;
}

// "transform.translation" for "translation": what is asked for one level too high is the commonest
// mistake, and no matter of spelling. False if no field's message has that name.
static bool find_below(const ProtobufCMessageDescriptor *descriptor, const char *name, char *out,
                       size_t size)
{
    for (unsigned i = 0; i < descriptor->n_fields; i++) {
        const ProtobufCFieldDescriptor *field = &descriptor->fields[i];
        if (field->type != PROTOBUF_C_TYPE_MESSAGE || bd_json_is_table(field) ||
            !protobuf_c_message_descriptor_get_field_by_name(field->descriptor, name))
            continue;
        snprintf(out, size, "%s%s.%s", field->name,
                 field->label == PROTOBUF_C_LABEL_REPEATED ? "[]" : "", name);
        return true;
    }
    return false;
}

static enum bd_err refuse_name(struct reader *reader, const char *name,
                               const ProtobufCMessageDescriptor *descriptor)
{
    char hint[BD_NEAREST_HINT_BYTES], below[BD_NEAREST_HINT_BYTES / 2];
    struct bd_nearest nearest;
    bd_nearest_begin(&nearest, name);
    for (unsigned i = 0; i < descriptor->n_fields; i++)
        bd_nearest_consider(&nearest, descriptor->fields[i].name);
    if (!nearest.name && find_below(descriptor, name, below, sizeof below)) nearest.name = below;
    path_push(reader, "%s%s", reader->path[0] ? "." : "", name);
    return bd_err_set(reader->detail, BD_ERR_USAGE, reader->path, "%s: there is no such name%s",
                      reader->path, bd_nearest_hint(&nearest, hint));
}

static enum bd_err check_names(struct reader *reader, const json_t *json,
                               const ProtobufCMessageDescriptor *descriptor)
{
    const char *name;
    json_t *value;
    json_object_foreach((json_t *)json, name, value)
    {
        if (!protobuf_c_message_descriptor_get_field_by_name(descriptor, name))
            return refuse_name(reader, name, descriptor);
    }
    return BD_ERR_OK;
}

static enum bd_err read_message(struct reader *reader, const json_t *json,
                                const ProtobufCMessageDescriptor *descriptor,
                                ProtobufCMessage **out)
{
    if (!json_is_object(json)) return refuse(reader, json, "an object");
    if (check_names(reader, json, descriptor)) return BD_ERR_USAGE;
    ProtobufCMessage *message = calloc(1, descriptor->sizeof_message);
    if (!message) return refuse_memory(reader);
    protobuf_c_message_init(descriptor, message);
    enum bd_err err = BD_ERR_OK;
    for (unsigned i = 0; !err && i < descriptor->n_fields; i++) {
        const ProtobufCFieldDescriptor *field = &descriptor->fields[i];
        json_t *value = json_object_get(json, field->name);
        if (!value) continue;
        size_t cut = path_push(reader, "%s%s", reader->path[0] ? "." : "", field->name);
        err = read_field(reader, value, field, message);
        path_pop(reader, cut);
    }
    if (err)
        protobuf_c_message_free_unpacked(message, NULL);
    else
        *out = message;
    return err;
}

enum bd_err bd_json_to_message(const json_t *json, const ProtobufCMessageDescriptor *descriptor,
                               ProtobufCMessage **out, struct bd_err_detail *detail)
{
    struct reader reader = {.detail = detail};
    return read_message(&reader, json, descriptor, out);
}

enum bd_err bd_json_text_to_message(const char *text, size_t size,
                                    const ProtobufCMessageDescriptor *descriptor,
                                    ProtobufCMessage **out, struct bd_err_detail *detail)
{
    if (size == 0) return bd_err_set(detail, BD_ERR_BAD_INPUT, "body", "the body is empty");
    json_error_t error;
    json_t *json = json_loadb(text, size, JSON_REJECT_DUPLICATES, &error);
    if (!json)
        return bd_err_set(detail, BD_ERR_BAD_INPUT, "body", "the body is no JSON: %s (line %d)",
                          error.text, error.line);
    enum bd_err err = bd_json_to_message(json, descriptor, out, detail);
    json_decref(json);
    return err;
}
