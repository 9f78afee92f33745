// What lower priorities are owed: higher ones go first, but not always, or a client with one view
// that takes the device all of its time would keep every batch waiting for ever.
//
// While a job runs and one of lower priority waits, or is set aside, an eighth of its time is owed
// to the lower ones. It is paid back by their running, whoever waits meanwhile. Two views without a
// pause leave a lower one a ninth of the device, or 50 ms of each frame that takes longer than 400.
//
// Render thread; arithmetic alone.

#ifndef BD_SCHED_FAIR_SHARE_H
#define BD_SCHED_FAIR_SHARE_H

#include <stdbool.h>

struct bd_fair_share {
    double owed_ms; // 0 to BD_SHARE_OWED_MAX_MS
};

#define BD_SHARE_OF_TIME     0.125
#define BD_SHARE_TURN_MS     10.0 // lower priorities come before a higher one for no less than this
#define BD_SHARE_OWED_MAX_MS 50.0 // what a higher one can be kept waiting

// A job ran for `ms`; whether others of lower and of higher priority waited meanwhile.
void bd_fair_share_note(struct bd_fair_share *share, double ms, bool lower_waits, bool higher_waits);

// Whether it is the turn of lower priorities although a higher one waits: of one that has to begin,
// and of one that runs already.
bool bd_fair_share_begins_lower(const struct bd_fair_share *share);
bool bd_fair_share_keeps_lower(const struct bd_fair_share *share);

#endif
