// A view's steps to a better picture: of technique `auto` the cheapest settings, for what moves;
// its request as it is, then the same with two, four, eight and sixteen sub-frames, then the rungs
// of the technique's ladder (frame/ladder.h) that are above its own parameters, as many at once as
// its row says. Sub-frames come first because they cost little: light is gathered once, and each
// frame goes on where the one before ended. Before the last rung, which takes longest, come 32 and
// 64 of them. Of a technique that draws by chance rounds of sub-frames (frame/sub_frames.h) follow
// in that rung's place: 128 sub-frames, 256, ... with light of their own, and so to the truth.
//
// Each step is a frame as anyone may ask for it alone, and has the same bytes.
//
// Thread: any.

#ifndef BD_NET_LIVE_VIEW_STEPS_H
#define BD_NET_LIVE_VIEW_STEPS_H

#include <stdbool.h>
#include <stdint.h>

#include "frame/report.h"
#include "frame/request.h"
#include "frame/sub_frames.h"

// Sub-frames up to which a still picture is smoothed: first, by light of the last rung but one, and
// by light that is drawn anew.
#define BD_VIEW_SUB_FRAMES          16u
#define BD_VIEW_SUB_FRAMES_OF_LIGHT BD_SUB_FRAMES_OF_ROUND
#define BD_VIEW_SUB_FRAMES_MOST     4096u

// Steps that come before the request as it is, 0 or 1: who wants no better picture begins there.
uint32_t bd_view_steps_before(const struct bd_frame_request *request);

// Whether there is a step of that number; 0 always is.
bool bd_view_has_step(const struct bd_frame_request *request, uint32_t step);

// Whether it has the parameters of the step before it, and more sub-frames. Not step 0.
bool bd_view_step_adds_sub_frames(const struct bd_frame_request *request, uint32_t step);

// Whether they have light of their own, which helps only what is decided by chance.
bool bd_view_step_draws_anew(const struct bd_frame_request *request, uint32_t step);

// Writes the step's sub-frames and parameters into `out`, which is a copy of `request`. A step past
// the last is the last.
void bd_view_lay_step(const struct bd_frame_request *request, uint32_t step,
                      struct bd_frame_request *out);

// --- what a next step costs ---
//
// Foretold from what the view's frames' passes took on the device. Time in which programs were
// compiled, meshes uploaded or pictures encoded counts for nothing, since it is spent once: a first
// frame that took ten seconds to compile may be followed by one that takes a tenth of a second.

// 0 before anything was learnt.
struct bd_view_cost {
    double sub_frame_ms; // G-buffer, direct light and what else each sub-frame has of its own
    double once_ms;      // of the last parameters: what is made for a light, or once a frame
};

// From a frame's report. `is_rung`: of a step's parameters made anew, not more sub-frames of the
// same.
void bd_view_cost_learn(struct bd_view_cost *cost, const struct bd_report *report, bool is_rung);

// Of more sub-frames of the same, from so many to so many.
double bd_view_cost_of_sub_frames(const struct bd_view_cost *cost, uint32_t from, uint32_t to);
// Of the next rung of the ladder, of which none costs more than BD_VIEW_RUNG_RATIO times the one
// before (tests/analytic/ladder.c), with so many sub-frames.
#define BD_VIEW_RUNG_RATIO 6
double bd_view_cost_of_rung(const struct bd_view_cost *cost, uint32_t sub_frames);

#endif
