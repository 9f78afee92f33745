// What a job's check traces: the integrand its frame is measured against, and how far other
// techniques' models are from the whole equation.
//
// Private to sched/. Thread: the checks' worker; tracing itself runs on the runner's pool.

#ifndef BD_SCHED_JOB_CHECK_TRACE_H
#define BD_SCHED_JOB_CHECK_TRACE_H

#include <stddef.h>

#include "base/err.h"
#include "frame/plan.h"
#include "reference/check.h"
#include "sched/check_views.h"
#include "sched/job.h"
#include "sched/reference_runner.h"

// What both functions below look at.
struct bd_checked {
    struct bd_job *job;
    const struct bd_technique *technique; // of its frame
    struct bd_image *const *layers;       // BD_LAYER_COUNT of them
    uint32_t pixel_count;                 // to trace
    enum bd_against against;
};

// Estimates the error of the frame.
BD_MUST_CHECK
enum bd_err bd_job_check_measure(struct bd_reference_runner *runner, struct bd_check_views *views,
                                 const struct bd_checked *checked, struct bd_check_result *out,
                                 struct bd_err_detail *detail);

// What technique reference is to be asked for to solve, for this view, what the frame is measured
// against: "model_of=rsm filter=box"; "" for all of the rendering equation at pixel centres.
void bd_job_check_settings(const struct bd_checked *checked, char *out, size_t size);

// Which part of the indirect light that the frame's technique has (its model, with all the samples
// in the world) the scene would hide from the surfaces that are seen; by the check's pixels. NAN
// where there is no such light.
BD_MUST_CHECK
enum bd_err bd_job_check_hidden_share(struct bd_reference_runner *runner,
                                      const struct bd_checked *checked, double *out,
                                      struct bd_err_detail *detail);

// Upper end of the error that `other` would have against the whole equation with all the samples in
// the world, by the same pixels; INFINITY where that cannot be told. `mean_reference` is of the
// frame's own check.
double bd_job_check_model_limit(struct bd_reference_runner *runner,
                                const struct bd_checked *checked, const struct bd_technique *other,
                                double mean_reference);

#endif
