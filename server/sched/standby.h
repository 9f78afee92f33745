// A frame for the case that a better one fails: that of the technique's cheapest rung, rendered
// first where a deadline may pass; and one that is to be improved (sched/improve.h).
//
// What both need (the G-buffer, shadow maps, direct light) the second takes from the memo. The
// bytes of neither depend on the clock; which of them is the result does, and a flag says so.
//
// Private to sched/. Thread: the render thread, but for bd_standby_create.

#ifndef BD_SCHED_STANDBY_H
#define BD_SCHED_STANDBY_H

#include <stdbool.h>

#include "sched/sched.h"

struct bd_standby;

// NULL where the request does not accept one, has no deadline, is planned, traced or checked, or
// stands on the cheapest rung itself. Otherwise changes the request to what is rendered first.
struct bd_standby *bd_standby_create(struct bd_job_request *request);
// Takes NULL.
void bd_standby_destroy(struct bd_standby **standby);

// Of a job whose frame stands: that one is kept, and the request becomes the better one. Should
// that fail, but for a cancel, the kept frame becomes the result.
void bd_standby_keep_for(struct bd_job *job, const struct bd_param_list *better);

// After each frame of a job. True: the cheap one is kept, and the job is to be rendered again, with
// the request as it came. Where that one's deadline has passed, the kept frame becomes the result.
bool bd_standby_take(struct bd_job *job);

#endif
