// A field of a message from text: queries and command lines, by the schema's own types.
//
// Thread: any. What a message holds is malloc'ed, as if it had been unpacked.

#ifndef BD_PROTOCOL_FIELD_TEXT_H
#define BD_PROTOCOL_FIELD_TEXT_H

#include <stdbool.h>
#include <stdint.h>

#include <protobuf-c/protobuf-c.h>

#include "base/err.h"

// The field itself, and beside it whether it is set, or how many there are.
void *bd_field_value(const ProtobufCMessage *message, const ProtobufCFieldDescriptor *field);
void *bd_field_presence(const ProtobufCMessage *message, const ProtobufCFieldDescriptor *field);

// One that is not repeated: text as it is, 0 or 1, a whole number, or a number. False, and the
// field says nothing: its type is another, or the text is none of it.
BD_MUST_CHECK
bool bd_field_set_text(ProtobufCMessage *message, const ProtobufCFieldDescriptor *field,
                       const char *text);

// Of digits alone, to `most`.
BD_MUST_CHECK
bool bd_text_whole(const char *text, uint64_t most, uint64_t *out);
// `end` stands behind it, which `*text` is then moved behind; 0: nothing does.
BD_MUST_CHECK
bool bd_text_number(const char **text, char end, double *out);

#endif
