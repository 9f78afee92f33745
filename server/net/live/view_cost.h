// What a view's next step would cost, from what its frames' passes took on the device. Time in
// which programs were compiled, meshes uploaded or pictures encoded counts for nothing, since it is
// spent once: a first frame that took ten seconds to compile may be followed by one that takes a
// tenth of a second.
//
// Thread: any.

#ifndef BD_NET_LIVE_VIEW_COST_H
#define BD_NET_LIVE_VIEW_COST_H

#include <stdint.h>

#include "frame/report.h"

// 0 before anything was learnt.
struct bd_view_cost {
    double sub_frame_ms; // G-buffer, direct light and what else each sub-frame has of its own
    double once_ms;      // of the last parameters: what is made for a light, or once a frame
};

// From a frame's report. `is_rung`: of a step's parameters made anew, not more sub-frames of the
// same.
void bd_view_cost_learn(struct bd_view_cost *cost, const struct bd_report *report, bool is_rung);

// Of so many sub-frames more of the same.
double bd_view_cost_of_sub_frames(const struct bd_view_cost *cost, uint32_t count);
// Of the next rung of the ladder, of which none costs more than BD_VIEW_RUNG_RATIO times the one
// before (tests/analytic/ladder.c), with so many sub-frames.
#define BD_VIEW_RUNG_RATIO 6
double bd_view_cost_of_rung(const struct bd_view_cost *cost, uint32_t sub_frames);

#endif
