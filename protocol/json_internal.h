// What the two halves of the JSON converter share.

#ifndef BD_PROTOCOL_JSON_INTERNAL_H
#define BD_PROTOCOL_JSON_INTERNAL_H

#include <protobuf-c/protobuf-c.h>
#include <stdbool.h>
#include <stddef.h>

#include "protocol/bounced.pb-c.h"

// A repeated KeyValue: an object in JSON.
bool bd_json_is_table(const ProtobufCFieldDescriptor *field);

// Bytes of one element as protobuf-c stores it in a message or an array.
size_t bd_json_element_size(ProtobufCType type);

#endif
