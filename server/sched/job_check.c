#include "sched/job_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "frame/ladder.h"
#include "sched/job_check_trace.h"
#include "sched/refine.h"

#define PIXELS_USUAL 512

static const uint32_t layers_read =
    1u << BD_LAYER_BEAUTY | 1u << BD_LAYER_INDIRECT | 1u << BD_LAYER_NORMAL | 1u << BD_LAYER_DEPTH;

// A frame and what is said of it.
struct kept {
    bool stands;
    struct bd_image *layers[BD_LAYER_COUNT];
    struct bd_report report;
    double mean_reference; // of its check
};

struct bd_job_check {
    const struct bd_technique *technique;
    struct bd_param_list given; // the request's own parameters
    uint32_t layers_asked;
    uint32_t rung;       // that is climbed to next
    uint32_t flag_count; // of the frame's own report; what a check adds comes behind
    struct bd_refinement refinement;
    struct kept best;
    struct bd_report_time spent_ms; // on all frames and checks so far
};

struct bd_job_check *bd_job_check_create(struct bd_frame_request *frame)
{
    struct bd_job_check *check = calloc(1, sizeof *check);
    BD_ASSERT(check);
    check->technique = bd_technique_find(frame->technique[0] ? frame->technique : "rsm", NULL);
    check->given = frame->params;
    check->layers_asked = frame->layers | 1u << BD_LAYER_BEAUTY;
    frame->layers |= layers_read;
    uint32_t pixels = frame->check_pixels ? frame->check_pixels : PIXELS_USUAL;
    bd_refine_init(&check->refinement, frame->target_error, pixels);
    if (frame->target_error > 0)
        check->rung = bd_ladder_begin(check->technique, &check->given, &frame->params);
    return check;
}

static void free_layers(struct bd_image *layers[BD_LAYER_COUNT])
{
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++) bd_image_destroy(&layers[l]);
}

void bd_job_check_destroy(struct bd_job_check **check)
{
    if (!*check) return;
    free_layers((*check)->best.layers);
    free(*check);
    *check = NULL;
}

// --- the report -----------------------------------------------------------------------------

static void report_error(const struct bd_job *job, const struct bd_check_result *result,
                         struct bd_report *report)
{
    report->error_count = 0;
    report->flag_count = job->check->flag_count;
    if (result->pixel_count == 0) {
        bd_report_flag(report, "error_unknown: no pixel is finite");
        return;
    }
    strcpy(report->errors[0].metric, "rel_rmse");
    strcpy(report->errors[0].against, bd_against_name(job->request.frame.against));
    report->errors[0].value = result->value;
    report->errors[0].low = result->low;
    report->errors[0].high = result->high;
    report->errors[0].samples = result->pixel_count;
    report->error_count = 1;
    if (result->tail) bd_report_flag(report, "error_tail");
}

static void add_time(struct bd_report_time *sum, const struct bd_report_time *time)
{
    sum->total += time->total;
    sum->load += time->load;
    sum->compile += time->compile;
    sum->gpu += time->gpu;
    sum->check += time->check;
    sum->readback += time->readback;
}

// --- refining -------------------------------------------------------------------------------

static void keep_best(struct bd_job *job, double mean_reference)
{
    struct kept *best = &job->check->best;
    free_layers(best->layers);
    memcpy(best->layers, job->result.layers, sizeof best->layers);
    memset(job->result.layers, 0, sizeof job->result.layers);
    best->report = job->result.report;
    best->mean_reference = mean_reference;
    best->stands = true;
}

// The best frame becomes the result, with the time of all that were tried.
static void finish(struct bd_job *job, enum bd_stopped stopped)
{
    struct bd_job_check *check = job->check;
    struct bd_job_result *result = &job->result;
    free_layers(result->layers);
    memcpy(result->layers, check->best.layers, sizeof result->layers);
    memset(check->best.layers, 0, sizeof check->best.layers);
    check->best.stands = false;
    result->report = check->best.report;
    result->report.time_ms = check->spent_ms;
    result->report.stopped = stopped;
    result->err = BD_ERR_OK;
    result->fault = (struct bd_fault){0};
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++)
        if (!(check->layers_asked >> l & 1)) bd_image_destroy(&result->layers[l]);
}

static bool climb(struct bd_job *job)
{
    struct bd_job_check *check = job->check;
    free_layers(job->result.layers);
    return bd_ladder_climb(check->technique, &check->given, &check->rung,
                           &job->request.frame.params);
}

static bool has_next_rung(const struct bd_job_check *check)
{
    return check->technique->ladder && check->technique->ladder[check->rung];
}

static struct bd_checked checked_of(struct bd_job *job, struct bd_image *const *layers)
{
    return (struct bd_checked){job, job->check->technique, layers,
                               job->check->refinement.pixel_count};
}

// The first technique of the registry whose model goes below the floor, measured on the same
// pixels; NULL if that is the reference alone.
static const struct bd_technique *find_below(struct bd_reference_runner *runner, struct bd_job *job,
                                             double floor, double *limit)
{
    const struct bd_checked checked = checked_of(job, job->check->best.layers);
    const struct bd_technique *technique;
    for (uint32_t i = 0; (technique = bd_technique_at(i)) != NULL; i++) {
        if (technique->is_reference || technique == job->check->technique) continue;
        *limit =
            bd_job_check_model_limit(runner, &checked, technique, job->check->best.mean_reference);
        if (*limit < floor) return technique;
    }
    return NULL;
}

// What goes below: against its own model, the reference with that model; against the whole
// equation, a technique whose model leaves out less, or the reference, which leaves out nothing.
static void report_floor(struct bd_reference_runner *runner, struct bd_job *job)
{
    struct bd_report *report = &job->check->best.report;
    double floor = report->errors[0].value, limit;
    if (report->error_count == 0) return;
    if (job->request.frame.against == BD_AGAINST_MODEL) {
        bd_report_flag(report, "error_floor: %.3g %% against model; below it: %s with model_of=%s",
                       100 * floor, bd_technique_reference.name, job->check->technique->name);
        return;
    }
    uint64_t start_ns = bd_clock_ns();
    const struct bd_technique *below = find_below(runner, job, floor, &limit);
    job->check->spent_ms.check += bd_ms_since(start_ns);
    job->check->spent_ms.total += bd_ms_since(start_ns);
    if (below)
        bd_report_flag(report, "error_floor: %.3g %% against full; below it: %s, down to %.3g %%",
                       100 * floor, below->name, 100 * limit);
    else
        bd_report_flag(report, "error_floor: %.3g %% against full; below it: %s alone", 100 * floor,
                       bd_technique_reference.name);
}

// Whether to go on, and with what: true to render again.
static bool decide(struct bd_reference_runner *runner, struct bd_job *job,
                   const struct bd_check_result *measured, bool *look)
{
    struct bd_job_check *check = job->check;
    bool is_better;
    enum bd_refine_next next =
        bd_refine_decide(&check->refinement, measured, has_next_rung(check), &is_better);
    *look = next == BD_REFINE_LOOK;
    if (*look) return false;
    if (is_better) keep_best(job, measured->mean_reference);
    switch (next) {
    case BD_REFINE_LOOK:
        break;
    case BD_REFINE_CLIMB:
        return climb(job);
    case BD_REFINE_REACHED:
        finish(job, BD_STOPPED_TARGET);
        break;
    case BD_REFINE_FLOOR:
        report_floor(runner, job);
        finish(job, BD_STOPPED_FLOOR);
        break;
    }
    return false;
}

static enum bd_err measure_and_report(struct bd_reference_runner *runner,
                                      struct bd_check_views *views, struct bd_job *job,
                                      struct bd_check_result *measured)
{
    uint64_t start_ns = bd_clock_ns();
    const struct bd_checked checked = checked_of(job, job->result.layers);
    enum bd_err err = bd_job_check_measure(runner, views, &checked, measured, &job->result.fault);
    double ms = bd_ms_since(start_ns);
    job->check->spent_ms.check += ms;
    job->check->spent_ms.total += ms;
    if (!err) report_error(job, measured, &job->result.report);
    return err;
}

// A frame that has no estimate yet is as good as any, as long as there is no other.
static void stop(struct bd_job *job, enum bd_err err)
{
    if (err == BD_ERR_DEADLINE) {
        if (!job->check->best.stands) keep_best(job, 0);
        finish(job, BD_STOPPED_DEADLINE);
        return;
    }
    job->result.err = err;
    job->result.report.time_ms = job->check->spent_ms;
    if (err == BD_ERR_CANCELLED) job->result.report.stopped = BD_STOPPED_CANCELLED;
    free_layers(job->result.layers);
    bd_job_describe_failure(job);
}

bool bd_job_check_run(struct bd_reference_runner *runner, struct bd_check_views *views,
                      struct bd_job *job)
{
    struct bd_check_result measured;
    enum bd_err err;
    bool again = false, look = true;
    add_time(&job->check->spent_ms, &job->result.report.time_ms);
    job->check->flag_count = job->result.report.flag_count;
    atomic_store(&job->progress_ppm, 0);
    atomic_store(&job->checking, true);
    while (look) {
        err = measure_and_report(runner, views, job, &measured);
        look = false;
        if (err) {
            stop(job, err);
        } else if (job->request.frame.target_error > 0) {
            again = decide(runner, job, &measured, &look);
        } else {
            keep_best(job, measured.mean_reference);
            finish(job, BD_STOPPED_COMPLETE);
        }
    }
    atomic_store(&job->checking, false);
    return again;
}

void bd_job_check_settle(struct bd_job *job)
{
    if (!job->check || job->result.err != BD_ERR_DEADLINE || !job->check->best.stands) return;
    add_time(&job->check->spent_ms, &job->result.report.time_ms);
    finish(job, BD_STOPPED_DEADLINE);
}
