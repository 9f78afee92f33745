// Frames that are rendered again, better: of technique `auto` while their own estimate of the error
// (frame/report.h) is above what nobody should have to ask for, and those with a budget of time
// while there is some left. What stands is kept, and is the answer should the better one fail.
//
// Of `auto` a *pilot* comes first, the same picture of some 64x48 pixels: by what it says of
// itself the whole one begins on the rung that it needs, and is rendered once. What both need of the
// lights' side the memo has.
//
// By its own estimate a frame is the same bytes whenever it is asked for. With a budget the clock
// decides how far it goes, and the flag `chosen_by_clock` says so; each setting by itself has the
// same bytes again.
//
// Private to sched/. Thread: the render thread, but for bd_improve_begin.

#ifndef BD_SCHED_IMPROVE_H
#define BD_SCHED_IMPROVE_H

#include <stdbool.h>

#include "sched/sched.h"

// Of beauty, relative: what `auto` is content with, of all its light or of what is shown of it.
#define BD_IMPROVE_ESTIMATE 0.05

// Rungs of a ladder that bring an estimate down to that.
uint32_t bd_improve_rungs_for_estimate(double estimate);
// Rungs to climb with so many milliseconds left after a frame of `request` that took `frame_ms`: to
// the best that by its passes (frame/cost.h) fits; two at most of a frame that the memo had.
uint32_t bd_improve_rungs_for_ms(const struct bd_frame_request *request,
                                 const struct bd_report *report, double frame_ms, double left_ms);
// How long such a frame may take before it is given up for the one that stands: what is left of the
// budget, and half of the whole again.
double bd_improve_patience_ms(double budget_ms, double spent_ms);

// Changes the request to what is rendered first: with a budget its ladder's cheapest rung; of
// `auto` a pilot, unless the picture is small, has a deadline or is checked; then one sub-frame, by
// which it is judged and from which the others go on.
void bd_improve_begin(struct bd_job *job);

// After each frame of a job that stands. True: it is kept, and the job is to be rendered again,
// with the request as it stands then.
bool bd_improve_take(struct bd_job *job);

#endif
