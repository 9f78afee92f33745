#include "protocol/json.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/text.h"
#include "protocol/json_internal.h"

#define EXACT_IN_DOUBLE (1ull << 53)

bool bd_json_is_table(const ProtobufCFieldDescriptor *field)
{
    return field->label == PROTOBUF_C_LABEL_REPEATED && field->type == PROTOBUF_C_TYPE_MESSAGE &&
           field->descriptor == &bounced__key_value__descriptor;
}

size_t bd_json_element_size(ProtobufCType type)
{
    switch (type) {
    case PROTOBUF_C_TYPE_INT32:
    case PROTOBUF_C_TYPE_SINT32:
    case PROTOBUF_C_TYPE_SFIXED32:
    case PROTOBUF_C_TYPE_UINT32:
    case PROTOBUF_C_TYPE_FIXED32:
    case PROTOBUF_C_TYPE_FLOAT:
    case PROTOBUF_C_TYPE_ENUM:
        return 4;
    case PROTOBUF_C_TYPE_INT64:
    case PROTOBUF_C_TYPE_SINT64:
    case PROTOBUF_C_TYPE_SFIXED64:
    case PROTOBUF_C_TYPE_UINT64:
    case PROTOBUF_C_TYPE_FIXED64:
    case PROTOBUF_C_TYPE_DOUBLE:
        return 8;
    case PROTOBUF_C_TYPE_BOOL:
        return sizeof(protobuf_c_boolean);
    case PROTOBUF_C_TYPE_STRING:
    case PROTOBUF_C_TYPE_MESSAGE:
        return sizeof(void *);
    case PROTOBUF_C_TYPE_BYTES:
        return sizeof(ProtobufCBinaryData);
    }
    return 0;
}

static json_t *json_from_u64(uint64_t value)
{
    if (value <= EXACT_IN_DOUBLE) return json_integer((json_int_t)value);
    char text[24];
    snprintf(text, sizeof text, "%llu", (unsigned long long)value);
    return json_string(text);
}

static json_t *json_from_i64(int64_t value)
{
    if (value >= -(int64_t)EXACT_IN_DOUBLE && value <= (int64_t)EXACT_IN_DOUBLE)
        return json_integer(value);
    char text[24];
    snprintf(text, sizeof text, "%lld", (long long)value);
    return json_string(text);
}

static json_t *json_from_double(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

// Names of files on a disk need not be UTF-8; JSON must be.
static json_t *json_from_string(const char *text)
{
    if (!text) return json_string("");
    json_t *json = json_string(text);
    return json ? json : json_string("(not UTF-8)");
}

// "1024" and "0.5" become numbers, "neutral" and "1e999" stay strings.
static json_t *json_from_value(const char *text)
{
    json_t *number = text ? json_loads(text, JSON_DECODE_ANY, NULL) : NULL;
    if (json_is_number(number)) return number;
    json_decref(number);
    return json_from_string(text);
}

static json_t *json_from_element(const ProtobufCFieldDescriptor *field, const void *element)
{
    switch (field->type) {
    case PROTOBUF_C_TYPE_INT32:
    case PROTOBUF_C_TYPE_SINT32:
    case PROTOBUF_C_TYPE_SFIXED32:
    case PROTOBUF_C_TYPE_ENUM:
        return json_integer(*(const int32_t *)element);
    case PROTOBUF_C_TYPE_UINT32:
    case PROTOBUF_C_TYPE_FIXED32:
        return json_integer(*(const uint32_t *)element);
    case PROTOBUF_C_TYPE_INT64:
    case PROTOBUF_C_TYPE_SINT64:
    case PROTOBUF_C_TYPE_SFIXED64:
        return json_from_i64(*(const int64_t *)element);
    case PROTOBUF_C_TYPE_UINT64:
    case PROTOBUF_C_TYPE_FIXED64:
        return json_from_u64(*(const uint64_t *)element);
    case PROTOBUF_C_TYPE_FLOAT:
        return json_from_double((double)*(const float *)element);
    case PROTOBUF_C_TYPE_DOUBLE:
        return json_from_double(*(const double *)element);
    case PROTOBUF_C_TYPE_BOOL:
        return json_boolean(*(const protobuf_c_boolean *)element);
    case PROTOBUF_C_TYPE_STRING:
        return json_from_string(*(char *const *)element);
    case PROTOBUF_C_TYPE_MESSAGE:
        return bd_json_from_message(*(ProtobufCMessage *const *)element);
    case PROTOBUF_C_TYPE_BYTES:
        return json_null(); // the schema has none: bytes are payload
    }
    return NULL;
}

static json_t *json_from_table(size_t count, Bounced__KeyValue *const *pairs)
{
    json_t *object = json_object();
    for (size_t i = 0; i < count; i++)
        json_object_set_new(object, pairs[i]->key ? pairs[i]->key : "",
                            json_from_value(pairs[i]->value));
    return object;
}

static json_t *json_from_repeated(const ProtobufCFieldDescriptor *field, size_t count,
                                  const char *elements)
{
    if (bd_json_is_table(field))
        return json_from_table(count, (Bounced__KeyValue *const *)(const void *)elements);
    json_t *array = json_array();
    for (size_t i = 0; i < count; i++)
        json_array_append_new(
            array, json_from_element(field, elements + i * bd_json_element_size(field->type)));
    return array;
}

static bool is_set(const ProtobufCMessage *message, const ProtobufCFieldDescriptor *field)
{
    const char *base = (const char *)message;
    const void *member = base + field->offset;
    if (field->flags & PROTOBUF_C_FIELD_FLAG_ONEOF)
        return *(const uint32_t *)(const void *)(base + field->quantifier_offset) == field->id;
    if (field->label == PROTOBUF_C_LABEL_REQUIRED) return true;
    if (field->type == PROTOBUF_C_TYPE_STRING || field->type == PROTOBUF_C_TYPE_MESSAGE)
        return *(void *const *)member != NULL;
    return *(const protobuf_c_boolean *)(const void *)(base + field->quantifier_offset);
}

json_t *bd_json_from_message(const ProtobufCMessage *message)
{
    json_t *object = json_object();
    for (unsigned i = 0; i < message->descriptor->n_fields; i++) {
        const ProtobufCFieldDescriptor *field = &message->descriptor->fields[i];
        const char *member = (const char *)message + field->offset;
        if (field->label == PROTOBUF_C_LABEL_REPEATED) {
            size_t count =
                *(const size_t *)(const void *)((const char *)message + field->quantifier_offset);
            json_object_set_new(
                object, field->name,
                json_from_repeated(field, count, *(char *const *)(const void *)member));
        } else if (is_set(message, field)) {
            json_object_set_new(object, field->name, json_from_element(field, member));
        }
    }
    return object;
}

char *bd_json_text_from_message(const ProtobufCMessage *message)
{
    json_t *json = bd_json_from_message(message);
    // Fifteen digits hide the noise of the last bit: 0.1 is written as 0.1.
    char *text = bd_text_escape_json(json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(15)));
    json_decref(json);
    return text;
}
