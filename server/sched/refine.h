// What to do after a checked frame did not yet reach the error that was asked for.
//
// Decisions alone: no frame, no tracing. Private to sched/. Thread: one at a time.

#ifndef BD_SCHED_REFINE_H
#define BD_SCHED_REFINE_H

#include <stdbool.h>
#include <stdint.h>

#include "reference/check.h"

enum bd_refine_next {
    BD_REFINE_REACHED, // the interval's upper end is below the target
    BD_REFINE_LOOK,    // the interval is too wide: the same frame, with more pixels traced
    BD_REFINE_CLIMB,   // the next rung of the ladder
    BD_REFINE_FLOOR,   // three refinements did not lower it, or there is no rung left
};

struct bd_refinement {
    double target;        // relative, > 0
    uint32_t pixel_count; // to trace next
    bool begun;           // there was a frame
    bool black;           // its figures, and `lowest`, are absolute
    uint32_t not_lowered; // refinements in a row
    double lowest;        // upper end of the best frame so far; INFINITY before the first
};

void bd_refine_init(struct bd_refinement *refinement, double target, uint32_t pixel_count);

// `is_better`: that frame is the best so far, and to be kept.
enum bd_refine_next bd_refine_decide(struct bd_refinement *refinement,
                                     const struct bd_check_result *result, bool has_next_rung,
                                     bool *is_better);

#endif
