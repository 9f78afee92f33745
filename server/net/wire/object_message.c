// An object's fields between the wire and the scene, by the schema's own description.

#include "net/wire/object_message.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "net/wire/answer.h"
#include "protocol/field_text.h"

static const ProtobufCFieldDescriptor *field_named(const ProtobufCMessage *message,
                                                   const char *name)
{
    return protobuf_c_message_descriptor_get_field_by_name(message->descriptor, name);
}

static bool is_set(const ProtobufCMessage *message, const ProtobufCFieldDescriptor *field)
{
    if (field->label == PROTOBUF_C_LABEL_REPEATED)
        return *(size_t *)bd_field_presence(message, field) > 0;
    if (field->type == PROTOBUF_C_TYPE_STRING)
        return *(char **)bd_field_value(message, field) != NULL;
    return *(protobuf_c_boolean *)bd_field_presence(message, field);
}

// --- reading ------------------------------------------------------------------------------------

static struct bd_field_value value_of(const struct bd_object_field *row,
                                      const ProtobufCMessage *message,
                                      const ProtobufCFieldDescriptor *field)
{
    void *at = bd_field_value(message, field);
    struct bd_field_value value = {.name = row->name};
    switch (row->type) {
    case BD_FIELD_NAME:
    case BD_FIELD_WORD:
        value.text = *(char **)at;
        break;
    case BD_FIELD_SWITCH:
        value.whole = *(protobuf_c_boolean *)at;
        break;
    case BD_FIELD_NUMBERS:
        value.numbers = row->count > 1 ? *(double **)at : at;
        value.count = row->count > 1 ? *(size_t *)bd_field_presence(message, field) : 1;
        break;
    case BD_FIELD_OBJECT:
    case BD_FIELD_MAP:
        value.whole = *(int32_t *)at;
        break;
    case BD_FIELD_HEAVY:
        break;
    }
    return value;
}

void bd_object_message_read(enum bd_object_kind kind, const ProtobufCMessage *message,
                            struct bd_edit_op *op)
{
    const struct bd_object_field_list list = bd_object_fields(kind);
    struct bd_field_value *values = malloc((list.count + 1) * sizeof *values);
    BD_ASSERT(values);
    op->fields = values;
    for (uint32_t i = 0; i < list.count; i++) {
        const ProtobufCFieldDescriptor *field = field_named(message, list.rows[i].name);
        BD_ASSERT(field); // each row is a field of the schema
        if (list.rows[i].type != BD_FIELD_HEAVY && is_set(message, field))
            values[op->field_count++] = value_of(&list.rows[i], message, field);
    }
}

bool bd_object_message_id(enum bd_object_kind kind, const ProtobufCMessage *message, int32_t *id)
{
    const ProtobufCFieldDescriptor *field = field_named(message, bd_object_kind_name(kind));
    BD_ASSERT(field);
    *id = *(int32_t *)bd_field_value(message, field);
    return is_set(message, field);
}

// --- filling ------------------------------------------------------------------------------------

static void set_numbers(const struct bd_object_field *row, const float *from,
                        ProtobufCMessage *message, const ProtobufCFieldDescriptor *field)
{
    double *list = bd_field_value(message, field);
    if (row->count > 1) {
        list = malloc(row->count * sizeof *list);
        BD_ASSERT(list);
        *(double **)bd_field_value(message, field) = list;
        *(size_t *)bd_field_presence(message, field) = row->count;
    } else {
        *(protobuf_c_boolean *)bd_field_presence(message, field) = 1;
    }
    for (uint32_t i = 0; i < row->count; i++) list[i] = bd_field_said(row, from[i]);
}

static void fill_field(const struct bd_object_field *row, const void *from,
                       ProtobufCMessage *message, const ProtobufCFieldDescriptor *field)
{
    void *to = bd_field_value(message, field);
    int word;
    switch (row->type) {
    case BD_FIELD_SWITCH:
        *(protobuf_c_boolean *)to = *(const bool *)from != row->inverted;
        break;
    case BD_FIELD_NUMBERS:
        set_numbers(row, from, message, field);
        return;
    case BD_FIELD_WORD:
        memcpy(&word, from, sizeof word);
        *(char **)to = bd_answer_text(row->words[word]);
        return;
    case BD_FIELD_OBJECT:
    case BD_FIELD_MAP: // whose first member is its texture
        memcpy(to, from, sizeof(int32_t));
        break;
    case BD_FIELD_NAME:
    case BD_FIELD_HEAVY:
        return;
    }
    *(protobuf_c_boolean *)bd_field_presence(message, field) = 1;
}

void bd_object_message_fill(enum bd_object_kind kind, const void *object, ProtobufCMessage *message)
{
    const struct bd_object_field_list list = bd_object_fields(kind);
    for (uint32_t i = 0; i < list.count; i++) {
        const struct bd_object_field *row = &list.rows[i];
        if (bd_field_holds(row, object))
            fill_field(row, bd_field_of(row, object), message, field_named(message, row->name));
    }
}
