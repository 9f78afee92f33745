// One job of technique reference: plan, prepare, trace, layers.
//
// Private to sched/. Thread: the reference's coordinator; tracing itself runs on the runner's pool.

#ifndef BD_SCHED_REFERENCE_TRACE_H
#define BD_SCHED_REFERENCE_TRACE_H

#include "base/err.h"
#include "sched/job.h"
#include "sched/reference_runner.h"

// Fills job->result, also after a failure as far as it came; describes the fault but for a cancel
// and a deadline.
BD_MUST_CHECK
enum bd_err bd_reference_trace_job(struct bd_reference_runner *runner, struct bd_job *job);

#endif
