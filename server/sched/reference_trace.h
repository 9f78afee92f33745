// One job of technique reference: plan, prepare, trace, layers.
//
// Private to sched/. Thread: the references' worker; tracing itself runs on the runner's pool.

#ifndef BD_SCHED_REFERENCE_TRACE_H
#define BD_SCHED_REFERENCE_TRACE_H

#include "base/err.h"
#include "frame/plan.h"
#include "sched/job.h"
#include "sched/reference_runner.h"

// The part of the rendering equation that parameters of technique reference name.
struct bd_integrand bd_reference_integrand_of(const struct bd_params *params);
// What a frame is of.
struct bd_reference_view bd_reference_view_of(const struct bd_frame_request *frame,
                                              const struct bd_plan *plan);

// Fills job->result, also after a failure as far as it came; describes the error but for a cancel
// and a deadline.
BD_MUST_CHECK
enum bd_err bd_reference_trace_job(struct bd_reference_runner *runner,
                                   const struct bd_runner_caller *caller, struct bd_job *job);

#endif
