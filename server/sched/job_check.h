// The error of a job's frame: estimated by spot checks, and lowered by climbing the technique's
// ladder if the request has a target.
//
// A checked job goes from the render thread to the checks' worker, and from there to its end or
// back, with other parameters. Frames of other jobs are rendered meanwhile. What `auto` reaches
// with no rung the reference traces, where its samples are not too many: then the job goes to its
// worker.
//
// Private to sched/. Thread: whoever has the job.

#ifndef BD_SCHED_JOB_CHECK_H
#define BD_SCHED_JOB_CHECK_H

#include <stdbool.h>

#include "sched/check_views.h"
#include "sched/job.h"
#include "sched/reference_runner.h"

struct bd_job_check;

// Changes the request to what is rendered first: the ladder's rung, the layers that a check reads.
struct bd_job_check *bd_job_check_create(struct bd_frame_request *frame);
// Takes NULL.
void bd_job_check_destroy(struct bd_job_check **check);

// Estimates the error of job->result, and says whether the job is to be rendered again, with the
// request as it stands then. Otherwise the result is final.
bool bd_job_check_run(struct bd_reference_runner *runner, struct bd_check_views *views,
                      struct bd_job *job);

// Of a job that was traced instead, whether that went well or not.
void bd_job_check_take_traced(struct bd_job *job);

// Of a job that failed while it was rendered: where a frame stands from before, that one is the
// result, unless somebody cancelled it. For jobs without checks nothing.
void bd_job_check_settle(struct bd_job *job);

#endif
