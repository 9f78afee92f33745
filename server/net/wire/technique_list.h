// The registered techniques as an answer: model, parameters, ladder, tolerance, hazards.
//
// Thread: the event loop's.

#ifndef BD_NET_WIRE_TECHNIQUE_LIST_H
#define BD_NET_WIRE_TECHNIQUE_LIST_H

#include "net/wire/answer.h"

// In the registry's order.
struct bd_answer bd_answer_techniques(void);

#endif
