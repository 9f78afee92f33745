// A view's steps to a better picture: its request's own parameters, then the rungs of the
// technique's ladder (frame/ladder.h) that are above them.
//
// Thread: any.

#ifndef BD_NET_VIEW_STEPS_H
#define BD_NET_VIEW_STEPS_H

#include <stdbool.h>
#include <stdint.h>

#include "frame/request.h"

// Whether there is a step of that number; 0 always is.
bool bd_view_has_step(const struct bd_frame_request *request, uint32_t step);

// Writes the step's parameters into `out`, which is a copy of `request`. A step past the last is
// the last.
void bd_view_lay_step(const struct bd_frame_request *request, uint32_t step,
                      struct bd_frame_request *out);

#endif
