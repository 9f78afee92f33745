#include "sched/job_check.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/clock.h"
#include "frame/ladder.h"
#include "image/tonemap.h"
#include "sched/job_check_trace.h"
#include "sched/refine.h"

#define PIXELS_USUAL 512

// Of what reaches a target: more samples a pixel than these nobody waits for.
#define SPP_MOST (1u << 20)

// Of all pixels together, that `auto` traces by itself: minutes of two cores.
#define SAMPLES_BY_ITSELF (UINT64_C(1) << 27)

// Another technique is worth naming where its floor is at most this part of the one that was met.
#define LOWER_FLOOR 0.9

static const uint32_t layers_read = 1u << BD_LAYER_BEAUTY | 1u << BD_LAYER_INDIRECT |
                                    1u << BD_LAYER_NORMAL | 1u << BD_LAYER_DEPTH |
                                    1u << BD_LAYER_ALBEDO;

// A frame and what is said of it.
struct kept {
    bool stands;
    struct bd_image *layers[BD_LAYER_COUNT];
    struct bd_report report;
    struct bd_check_result checked;
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
    check->technique = bd_technique_for(frame->technique, &frame->params, NULL);
    check->given = frame->params;
    check->layers_asked = frame->layers | 1u << BD_LAYER_BEAUTY;
    if (frame->auto_exposure) check->layers_asked |= BD_LAYERS_METERED;
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

// Behind those that are there.
static void report_error(const struct bd_check_result *result, enum bd_against against,
                         struct bd_report *report)
{
    uint32_t at = report->error_count++;
    BD_ASSERT_CMP(at, <, BD_REPORT_ERROR_MAX);
    strcpy(report->errors[at].metric, result->black ? "rmse" : "rel_rmse");
    strcpy(report->errors[at].against, bd_against_name(against));
    report->errors[at].value = result->value;
    report->errors[at].low = result->low;
    report->errors[at].high = result->high;
    report->errors[at].samples = result->pixel_count;
}

// What is said of a frame by its first figure, the one that decides.
static void report_first_error(const struct bd_job *job, const struct bd_check_result *result,
                               struct bd_report *report)
{
    report->error_count = 0;
    report->flag_count = job->check->flag_count;
    bd_report_refused_rays(report, result->refused_ray_count);
    if (result->pixel_count == 0)
        bd_report_flag(report, "error_unknown: no pixel is finite");
    else
        report_error(result, job->request.frame.against, report);
    if (result->tail) bd_report_flag(report, "error_tail");
}

// --- refining -------------------------------------------------------------------------------

static void keep_best(struct bd_job *job, const struct bd_check_result *checked)
{
    struct kept *best = &job->check->best;
    free_layers(best->layers);
    memcpy(best->layers, job->result.layers, sizeof best->layers);
    memset(job->result.layers, 0, sizeof job->result.layers);
    best->report = job->result.report;
    best->checked = *checked;
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
    result->detail = (struct bd_err_detail){0};
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

static struct bd_checked checked_of(struct bd_job *job, struct bd_image *const *layers,
                                    enum bd_against against)
{
    return (struct bd_checked){job, job->check->technique, layers,
                               job->check->refinement.pixel_count, against};
}

static void spend(struct bd_job *job, uint64_t start_ns)
{
    const double ms = bd_ms_since(start_ns);
    job->check->spent_ms.check += ms;
    job->check->spent_ms.total += ms;
}

static enum bd_err measure(struct bd_reference_runner *runner, struct bd_check_views *views,
                           const struct bd_checked *checked, struct bd_check_result *out)
{
    struct bd_job *job = checked->job;
    uint64_t start_ns = bd_clock_ns();
    enum bd_err err = bd_job_check_measure(runner, views, checked, out, &job->result.detail);
    spend(job, start_ns);
    return err;
}

// --- the floor --------------------------------------------------------------------------------

static bool is_same_model(const struct bd_technique *a, const struct bd_technique *b)
{
    const struct bd_model *x = &a->model, *y = &b->model;
    return x->indirect_bounces == y->indirect_bounces &&
           x->indirect_visibility == y->indirect_visibility && x->lights == y->lights &&
           x->glossy_receivers == y->glossy_receivers && x->glossy_senders == y->glossy_senders &&
           x->transmission == y->transmission && x->coverage == y->coverage;
}

// Whether one that stands before it in the registry, or the frame's own, leaves out the same.
static bool is_model_known(const struct bd_technique *own, uint32_t index)
{
    const struct bd_technique *technique = bd_technique_at(index);
    if (is_same_model(own, technique)) return true;
    for (uint32_t i = 0; i < index; i++)
        if (is_same_model(bd_technique_at(i), technique)) return true;
    return false;
}

// The first technique of the registry whose model goes clearly below the floor, measured on the
// same pixels; NULL if that is the reference alone.
static const struct bd_technique *find_below(struct bd_reference_runner *runner, struct bd_job *job,
                                             double floor, double *limit)
{
    const struct bd_checked checked =
        checked_of(job, job->check->best.layers, job->request.frame.against);
    const double mean_reference = job->check->best.checked.mean_reference;
    const struct bd_technique *technique, *found = NULL;
    uint64_t start_ns = bd_clock_ns();
    for (uint32_t i = 0; !found && (technique = bd_technique_at(i)) != NULL; i++) {
        if (technique->is_reference || is_model_known(job->check->technique, i)) continue;
        *limit = bd_job_check_model_limit(runner, &checked, technique, mean_reference);
        if (*limit < LOWER_FLOOR * floor) found = technique;
    }
    spend(job, start_ns);
    return found;
}

// Samples a pixel with which the reference's own noise is below the target: twice those that its
// variance, known from some pixels only, asks for, on a step of its ladder's kind.
static uint32_t samples_for(const struct bd_check_result *checked, double target)
{
    double wanted = 2 * checked->sample_variance / (target * target);
    uint32_t spp = 4;
    while (spp < wanted && spp < SPP_MOST) spp *= 2;
    return spp;
}

// What reaches the target: the reference, in the words that ask for it. Against the whole equation
// also a technique whose model leaves out less, if one goes below.
static void report_floor(struct bd_reference_runner *runner, struct bd_job *job)
{
    struct kept *best = &job->check->best;
    const enum bd_against against = job->request.frame.against;
    const struct bd_checked checked = checked_of(job, best->layers, against);
    if (best->report.error_count == 0) return;
    const double floor = best->report.errors[0].value, target = job->request.frame.target_error;
    char settings[96], below[64] = "", figure[48];
    bd_job_check_settings(&checked, settings, sizeof settings);
    if (best->checked.black)
        snprintf(figure, sizeof figure, "%.3g cd/m^2", floor);
    else
        snprintf(figure, sizeof figure, "%.3g %%", 100 * floor);
    double limit;
    const struct bd_technique *technique =
        against == BD_AGAINST_FULL ? find_below(runner, job, floor, &limit) : NULL;
    if (technique)
        snprintf(below, sizeof below, "; below it: %s, down to %.3g %%", technique->name,
                 100 * limit);
    bd_report_flag(&best->report, "error_floor: %s against %s; %.3g %% reached by: %s spp=%u%s%s%s",
                   figure, bd_against_name(against), 100 * target, bd_technique_reference.name,
                   samples_for(&best->checked, target), settings[0] ? " " : "", settings, below);
}

// The best frame is the result of a job whose next one failed.
static void give_best(struct bd_job *job)
{
    const struct bd_err_detail detail = job->result.detail;
    const bool is_late = job->result.err == BD_ERR_DEADLINE;
    finish(job, is_late ? BD_STOPPED_DEADLINE : BD_STOPPED_FLOOR);
    if (!is_late)
        bd_report_flag(&job->result.report, "error_floor: better settings fail: %s",
                       detail.message);
}

// --- the reference instead ----------------------------------------------------------------------

// Not where a layer is asked for that the reference does not have.
static bool may_trace(const struct bd_job *job)
{
    const struct bd_frame_request *frame = &job->request.frame;
    const struct kept *best = &job->check->best;
    const uint64_t pixels = (uint64_t)frame->width_px * frame->height_px;
    return bd_technique_is_auto(frame->technique) &&
           !(job->check->layers_asked & BD_LAYERS_DOUBT) && best->report.error_count > 0 &&
           !best->checked.black &&
           pixels * samples_for(&best->checked, frame->target_error) <= SAMPLES_BY_ITSELF;
}

// "KEY=VALUE KEY=VALUE".
static void add_words(const char *words, struct bd_param_list *out)
{
    char pair[BD_PARAM_KEY_MAX + BD_PARAM_VALUE_MAX];
    while (sscanf(words, " %79s", pair) == 1) {
        enum bd_err err = bd_param_list_add(out, pair, NULL);
        BD_ASSERT(!err);
        words = strstr(words, pair) + strlen(pair);
    }
}

// The same picture with as many samples as the target asks for.
static void trace_instead(struct bd_job *job)
{
    struct bd_job_check *check = job->check;
    struct bd_frame_request *frame = &job->request.frame;
    const struct bd_checked checked = checked_of(job, check->best.layers, frame->against);
    char words[160], settings[96];
    bd_job_check_settings(&checked, settings, sizeof settings);
    snprintf(words, sizeof words, "spp=%u %s",
             samples_for(&check->best.checked, frame->target_error), settings);
    frame->params = (struct bd_param_list){0};
    add_words(words, &frame->params);
    strcpy(frame->technique, bd_technique_reference.name);
    frame->aa = 1;
    frame->layers = (check->layers_asked & ~BD_LAYERS_DOUBT) | 1u << BD_LAYER_VARIANCE;
    free_layers(job->result.layers);
}

// Its noise is all that is wrong with it.
static void report_variance(const struct bd_image *const layers[BD_LAYER_COUNT],
                            struct bd_report *report)
{
    const struct bd_image *beauty = layers[BD_LAYER_BEAUTY], *variance = layers[BD_LAYER_VARIANCE];
    struct bd_doubt_sums sums = bd_doubt_sums_of(bd_exposure_auto(beauty));
    const size_t pixels = (size_t)beauty->width_px * beauty->height_px;
    for (size_t i = 0; i < 3 * pixels; i++)
        bd_doubt_sums_add(&sums, beauty->pixels[4 * (i / 3) + i % 3], variance->pixels[i]);
    bd_report_own_estimate(report, &sums);
}

void bd_job_check_take_traced(struct bd_job *job)
{
    struct bd_job_check *check = job->check;
    struct bd_job_result *result = &job->result;
    if (!check || result->err == BD_ERR_CANCELLED) return;
    bd_report_add_time(&check->spent_ms, &result->report.time_ms);
    if (result->err) {
        give_best(job);
        return;
    }
    report_variance((const struct bd_image *const *)result->layers, &result->report);
    result->report.time_ms = check->spent_ms;
    result->report.stopped = BD_STOPPED_TARGET;
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++)
        if (!(check->layers_asked >> l & 1)) bd_image_destroy(&result->layers[l]);
}

// --- the end ----------------------------------------------------------------------------------

// A frame that has no estimate yet is as good as any, as long as there is no other.
static void stop(struct bd_job *job, enum bd_err err)
{
    if (err == BD_ERR_DEADLINE) {
        const struct bd_check_result unknown = {0};
        if (!job->check->best.stands) keep_best(job, &unknown);
        finish(job, BD_STOPPED_DEADLINE);
        return;
    }
    job->result.err = err;
    job->result.report.time_ms = job->check->spent_ms;
    if (err == BD_ERR_CANCELLED) job->result.report.stopped = BD_STOPPED_CANCELLED;
    free_layers(job->result.layers);
    bd_job_describe_failure(job);
}

// How much of its indirect light a frame without occlusion would not have.
static enum bd_err report_hidden(struct bd_reference_runner *runner,
                                 const struct bd_checked *checked, struct bd_report *report)
{
    if (!report->unoccluded) return BD_ERR_OK;
    uint64_t start_ns = bd_clock_ns();
    double share;
    enum bd_err err =
        bd_job_check_hidden_share(runner, checked, &share, &checked->job->result.detail);
    spend(checked->job, start_ns);
    if (!err && !isnan(share))
        bd_report_reword(report, BD_FLAG_UNOCCLUDED,
                         BD_FLAG_UNOCCLUDED ": %.*f %% of the indirect light is hidden",
                         share < 0.1, 100 * share);
    return err;
}

// The best frame's other figure, which decides nothing; then the end. Where time runs out meanwhile
// the first one stands alone.
static void conclude(struct bd_reference_runner *runner, struct bd_check_views *views,
                     struct bd_job *job, enum bd_stopped stopped)
{
    struct kept *best = &job->check->best;
    const enum bd_against other =
        job->request.frame.against == BD_AGAINST_FULL ? BD_AGAINST_MODEL : BD_AGAINST_FULL;
    const struct bd_checked checked = checked_of(job, best->layers, other);
    struct bd_check_result result;
    enum bd_err err = BD_ERR_OK;
    if (best->report.error_count > 0) {
        err = measure(runner, views, &checked, &result);
        if (!err) report_error(&result, other, &best->report);
        if (!err) err = report_hidden(runner, &checked, &best->report);
    }
    if (err && err != BD_ERR_DEADLINE)
        stop(job, err);
    else
        finish(job, stopped);
}

// Whether to go on, and with what: true to render again.
static bool decide(struct bd_reference_runner *runner, struct bd_check_views *views,
                   struct bd_job *job, const struct bd_check_result *measured, bool *look)
{
    struct bd_job_check *check = job->check;
    bool is_better;
    enum bd_refine_next next =
        bd_refine_decide(&check->refinement, measured, has_next_rung(check), &is_better);
    *look = next == BD_REFINE_LOOK;
    if (*look) return false;
    if (is_better) keep_best(job, measured);
    switch (next) {
    case BD_REFINE_LOOK:
        break;
    case BD_REFINE_CLIMB:
        return climb(job);
    case BD_REFINE_REACHED:
        conclude(runner, views, job, BD_STOPPED_TARGET);
        break;
    case BD_REFINE_FLOOR:
        if (may_trace(job)) {
            trace_instead(job);
            return true;
        }
        report_floor(runner, job);
        conclude(runner, views, job, BD_STOPPED_FLOOR);
        break;
    }
    return false;
}

bool bd_job_check_run(struct bd_reference_runner *runner, struct bd_check_views *views,
                      struct bd_job *job)
{
    struct bd_check_result measured;
    bool again = false, look = true;
    bd_report_add_time(&job->check->spent_ms, &job->result.report.time_ms);
    job->check->flag_count = job->result.report.flag_count;
    atomic_store(&job->progress_ppm, 0);
    atomic_store(&job->checking, true);
    while (look) {
        const struct bd_checked checked =
            checked_of(job, job->result.layers, job->request.frame.against);
        enum bd_err err = measure(runner, views, &checked, &measured);
        look = false;
        if (err) {
            stop(job, err);
            break;
        }
        report_first_error(job, &measured, &job->result.report);
        if (job->request.frame.target_error > 0) {
            again = decide(runner, views, job, &measured, &look);
        } else {
            keep_best(job, &measured);
            conclude(runner, views, job, BD_STOPPED_COMPLETE);
        }
    }
    atomic_store(&job->checking, false);
    return again;
}

void bd_job_check_settle(struct bd_job *job)
{
    const enum bd_err err = job->result.err;
    if (!job->check || !err || err == BD_ERR_CANCELLED || !job->check->best.stands) return;
    bd_report_add_time(&job->check->spent_ms, &job->result.report.time_ms);
    give_best(job);
}
