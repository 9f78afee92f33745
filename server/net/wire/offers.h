// What a server offers, as answers: its devices, its techniques, the options of frames.
//
// Thread: the event loop's.

#ifndef BD_NET_WIRE_OFFERS_H
#define BD_NET_WIRE_OFFERS_H

#include "net/wire/answer.h"
#include "sched/sched.h"

// `list_json`: an array of objects in the form of the schema's Device (unknown fields are
// ignored), or NULL. The device in use comes first and is always there.
struct bd_answer bd_answer_devices(struct bd_sched *sched, const char *list_json);

// The registered ones: model, parameters, ladder, tolerance, hazards; in the registry's order.
struct bd_answer bd_answer_techniques(void);

// The rows of protocol/frame_options.h.
struct bd_answer bd_answer_options(void);

#endif
