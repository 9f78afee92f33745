// The schema's JSON form: one converter over protobuf-c's descriptors, for every message.
//
// Names are the schema's own, in snake_case. Fields that are not set are left out, empty
// lists are not. A repeated KeyValue is an object; its values that read as JSON numbers are
// numbers. 64-bit integers are numbers up to 2^53 and decimal strings above, since most readers of
// JSON hold numbers as doubles. Numbers that JSON cannot say (NaN, Inf) are null. Text has escapes
// for characters that would command a terminal or are not seen (base/text.h).
//
// Reading is strict: a name that the schema does not have and a value of the wrong type are refused
// with their path ("ops[3].set_node.translation", "frame.size[1]"). The keys of an object that
// stands for a repeated KeyValue are the user's. Thread: any.

#ifndef BD_PROTOCOL_JSON_H
#define BD_PROTOCOL_JSON_H

#include <jansson.h>
#include <protobuf-c/protobuf-c.h>
#include <stddef.h>

#include "base/err.h"

#ifdef __cplusplus
extern "C" {
#endif

// The caller owns the reference. NULL only without memory.
json_t *bd_json_from_message(const ProtobufCMessage *message);

// Compact text, one line. The caller frees it. NULL only without memory.
char *bd_json_text_from_message(const ProtobufCMessage *message);

// Fills a new message of type `descriptor`. Free with protobuf_c_message_free_unpacked(m, NULL).
// With the path in `detail->field`: BD_ERR_USAGE for a name, BD_ERR_BAD_INPUT for a value;
// BD_ERR_NO_MEMORY.
BD_MUST_CHECK
enum bd_err bd_json_to_message(const json_t *json, const ProtobufCMessageDescriptor *descriptor,
                               ProtobufCMessage **out, struct bd_err_detail *detail);

// The same from text. Duplicate keys, nesting beyond jansson's limit and bytes behind the value
// are refused.
BD_MUST_CHECK
enum bd_err bd_json_text_to_message(const char *text, size_t size,
                                    const ProtobufCMessageDescriptor *descriptor,
                                    ProtobufCMessage **out, struct bd_err_detail *detail);

#ifdef __cplusplus
}
#endif

#endif
