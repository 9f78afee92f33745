// An object's fields between the wire and the scene: what a message says by what its rows are
// called (scene/model/object_fields.h), and the other way round.
//
// Thread: any.

#ifndef BD_NET_WIRE_OBJECT_MESSAGE_H
#define BD_NET_WIRE_OBJECT_MESSAGE_H

#include <protobuf-c/protobuf-c.h>

#include "scene/edit/edit.h"
#include "scene/model/object_fields.h"

// What the message sets of the rows of a kind, as op->fields: malloc'ed; texts and numbers are
// borrowed from the message.
void bd_object_message_read(enum bd_object_kind kind, const ProtobufCMessage *message,
                            struct bd_edit_op *op);
// The object's own id, in the field that is called as its kind. False: not set.
bool bd_object_message_id(enum bd_object_kind kind, const ProtobufCMessage *message, int32_t *id);

// Sets every field that the object has, but its name. What is in the message is malloc'ed.
void bd_object_message_fill(enum bd_object_kind kind, const void *object,
                            ProtobufCMessage *message);

#endif
