// What a frame of better settings would take, by what the passes of one took: each grows with a
// parameter of its own, so that no machine and no scene needs a table of times.
//
// Any thread.

#ifndef BD_FRAME_COST_H
#define BD_FRAME_COST_H

#include <stdbool.h>

#include "frame/report.h"
#include "technique/technique.h"

// Milliseconds that a frame with `better` takes, after one with `given` of the same technique whose
// report that is and which took `frame_ms`. False where passes that grow were not made but had from
// an earlier frame, so that nobody knows, or parameters are not to be read.
bool bd_cost_ms(const struct bd_report *report, double frame_ms,
                const struct bd_technique *technique, const struct bd_param_list *given,
                const struct bd_param_list *better, double *out_ms);

#endif
