// The options of frames as an answer: the rows of protocol/frame_options.h.
//
// Thread: the event loop's.

#ifndef BD_NET_WIRE_OPTION_LIST_H
#define BD_NET_WIRE_OPTION_LIST_H

#include "net/wire/answer.h"

struct bd_answer bd_answer_options(void);

#endif
