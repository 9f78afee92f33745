// The devices of this machine as an answer.
//
// Thread: the event loop's.

#ifndef BD_NET_WIRE_DEVICE_LIST_H
#define BD_NET_WIRE_DEVICE_LIST_H

#include "net/wire/answer.h"
#include "sched/sched.h"

// `list_json`: an array of objects in the form of the schema's Device (unknown fields are
// ignored), or NULL. The device in use comes first and is always there.
struct bd_answer bd_answer_devices(struct bd_sched *sched, const char *list_json);

#endif
