#include "protocol/field_text.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

void *bd_field_value(const ProtobufCMessage *message, const ProtobufCFieldDescriptor *field)
{
    return (char *)message + field->offset;
}

void *bd_field_presence(const ProtobufCMessage *message, const ProtobufCFieldDescriptor *field)
{
    return (char *)message + field->quantifier_offset;
}

bool bd_text_whole(const char *text, uint64_t most, uint64_t *out)
{
    char *end;
    if (!isdigit((unsigned char)*text)) return false; // a sign, a space
    errno = 0;
    *out = strtoull(text, &end, 10);
    return !errno && !*end && *out <= most;
}

bool bd_text_number(const char **text, char end, double *out)
{
    char *behind;
    if (isspace((unsigned char)**text)) return false;
    *out = strtod(*text, &behind);
    if (behind == *text || *behind != end) return false;
    *text = behind + (end != 0);
    return true;
}

static void set_string(char **value, const char *text)
{
    free(*value);
    *value = strdup(text);
    BD_ASSERT(*value);
}

bool bd_field_set_text(ProtobufCMessage *message, const ProtobufCFieldDescriptor *field,
                       const char *text)
{
    void *const at = bd_field_value(message, field);
    protobuf_c_boolean *has = bd_field_presence(message, field);
    uint64_t whole = 0;
    if (field->label == PROTOBUF_C_LABEL_REPEATED) return false;
    switch (field->type) {
    case PROTOBUF_C_TYPE_STRING:
        set_string(at, text);
        return true;
    case PROTOBUF_C_TYPE_BOOL:
        *has = strcmp(text, "0") == 0 || strcmp(text, "1") == 0;
        *(protobuf_c_boolean *)at = *has && *text == '1';
        return *has;
    case PROTOBUF_C_TYPE_UINT32:
        *has = bd_text_whole(text, UINT32_MAX, &whole);
        *(uint32_t *)at = (uint32_t)whole;
        return *has;
    case PROTOBUF_C_TYPE_UINT64:
        *has = bd_text_whole(text, UINT64_MAX, at);
        return *has;
    case PROTOBUF_C_TYPE_DOUBLE:
        *has = bd_text_number(&text, 0, at);
        return *has;
    default:
        return false;
    }
}
