#include "sched/improve.h"

#include <math.h>

#include "base/clock.h"
#include "frame/cost.h"
#include "frame/ladder.h"
#include "sched/job.h"
#include "sched/standby.h"

// What a rung leaves of the estimate of the one before: .60 to .81 in seven scenes.
#define LEFT_BY_RUNG 0.66
// What a rung takes of the time of the one before, where no pass tells: 1.1 to 1.9 in three scenes,
// up to 4 of the upper ones of small pictures. Two are climbed at most: then more is known.
#define TIME_OF_RUNG  1.6
#define RUNGS_AT_ONCE 2
// What is foretold is up to so much too little.
#define COST_MARGIN 1.15
// Of a budget, that a frame which was foretold to fit may take beyond it: where the machine turned
// slower meanwhile, that is nearer to what was asked for than the cheapest frame.
#define OVERDRAFT 0.5

uint32_t bd_improve_rungs_for_estimate(double estimate)
{
    if (!(estimate > BD_IMPROVE_ESTIMATE)) return 0;
    return (uint32_t)ceil(log(BD_IMPROVE_ESTIMATE / estimate) / log(LEFT_BY_RUNG));
}

// Of all its light, or of what is shown of it: single pixels that are a hundred times as bright as
// white decide nothing. 0 where a frame tells none.
static double estimate_of(const struct bd_report *report)
{
    return report->has_own_estimate ? fmin(report->own_estimate, report->shown_estimate) : 0;
}

static const struct bd_technique *technique_of(const struct bd_frame_request *frame)
{
    return bd_technique_for(frame->technique, &frame->params, NULL);
}

static uint32_t rungs_at_a_guess(double frame_ms, double left_ms)
{
    if (left_ms < TIME_OF_RUNG * frame_ms) return 0;
    return left_ms >= pow(TIME_OF_RUNG, 2 * RUNGS_AT_ONCE) * frame_ms ? RUNGS_AT_ONCE : 1;
}

uint32_t bd_improve_rungs_for_ms(const struct bd_frame_request *request,
                                 const struct bd_report *report, double frame_ms, double left_ms)
{
    const struct bd_technique *technique = technique_of(request);
    struct bd_param_list better;
    double cost_ms;
    uint32_t rungs = 0;
    if (!(frame_ms > 0) || !(left_ms > 0)) return 0;
    while (bd_ladder_above(technique, &request->params, rungs + 1, &better) == rungs + 1) {
        if (!bd_cost_ms(report, frame_ms, technique, &request->params, &better, &cost_ms))
            return rungs_at_a_guess(frame_ms, left_ms);
        if (COST_MARGIN * cost_ms > left_ms) break;
        rungs++;
    }
    return rungs;
}

double bd_improve_patience_ms(double budget_ms, double spent_ms)
{
    return fmax((1 + OVERDRAFT) * budget_ms - spent_ms, 0);
}

static bool judges_itself(const struct bd_job *job)
{
    const struct bd_frame_request *frame = &job->request.frame;
    return job->request.improves && bd_technique_is_auto(frame->technique) &&
           technique_of(frame)->is_sampled && frame->budget_ms == 0 && frame->target_error == 0 &&
           !frame->plan_only;
}

// --- the pilot ---------------------------------------------------------------------------------

// Pixels from which on one is worth its while: it takes some 60 ms of two cores, a fifth of a
// frame of 256x192.
#define PILOT_FROM     (UINT64_C(1) << 17)
#define PILOT_PIXELS   3072.0 // 64x48
#define PILOT_LEAST_PX 24u
// What does not go with pixels, but for the lights' side, which the frame takes over.
#define PILOT_CELLS "256"
// A small picture has more edges, and its filter less to smooth: by so much its estimate is above
// the whole one's. 64x48 for 256x192, of what is shown: .92 to 1.66 in fifteen scenes, in the mean
// this.
#define PILOT_EXCESS 1.15

static void begin_with_pilot(struct bd_job *job)
{
    struct bd_frame_request *frame = &job->request.frame;
    const uint64_t pixels = (uint64_t)frame->width_px * frame->height_px;
    const double part = sqrt((double)pixels / PILOT_PIXELS); // of a side
    const uint32_t width_px = (uint32_t)(frame->width_px / part);
    const uint32_t height_px = (uint32_t)(frame->height_px / part);
    if (pixels < PILOT_FROM || width_px < PILOT_LEAST_PX || height_px < PILOT_LEAST_PX) return;
    if (frame->deadline_ms > 0 || bd_frame_request_is_checked(frame)) return;
    job->asked_width_px = frame->width_px;
    job->asked_height_px = frame->height_px;
    job->asked_layers = frame->layers;
    job->asked_params = frame->params;
    frame->width_px = width_px;
    frame->height_px = height_px;
    frame->layers = 1u << BD_LAYER_BEAUTY;
    bd_ladder_lay_over("cache_cells=" PILOT_CELLS, &job->asked_params, &frame->params);
}

// The request as it came, but for rungs that the pilot's estimate asks for.
static void follow_pilot(struct bd_job *job)
{
    struct bd_frame_request *frame = &job->request.frame;
    const struct bd_report *report = &job->result.report;
    struct bd_param_list better;
    const uint32_t rungs = bd_improve_rungs_for_estimate(estimate_of(report) / PILOT_EXCESS);
    frame->params = job->asked_params;
    if (bd_ladder_above(technique_of(frame), &frame->params, rungs, &better) > 0)
        frame->params = better;
    else if (frame->fresh == BD_FRESH_ALL)
        frame->fresh = BD_FRESH_CAMERA; // the lights' side is made anew: by the pilot
    frame->width_px = job->asked_width_px;
    frame->height_px = job->asked_height_px;
    frame->layers = job->asked_layers;
    job->asked_width_px = 0;
    job->pilot_ms = report->time_ms;
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++) bd_image_destroy(&job->result.layers[l]);
    job->result = (struct bd_job_result){0};
}

void bd_improve_begin(struct bd_job *job)
{
    struct bd_frame_request *frame = &job->request.frame;
    struct bd_param_list cheap;
    if (judges_itself(job)) begin_with_pilot(job);
    if (judges_itself(job) && frame->aa > 1) {
        job->asked_aa = frame->aa;
        frame->aa = 1;
    }
    if (frame->budget_ms == 0 || frame->plan_only) return;
    if (bd_ladder_cheapest(technique_of(frame), &frame->params, &cheap)) frame->params = cheap;
}

// Programs are compiled and scenes uploaded once: that is no part of what frames take.
static double frame_ms(const struct bd_report *report)
{
    return report->time_ms.total - report->time_ms.compile - report->time_ms.load;
}

static uint32_t rungs_of(struct bd_job *job)
{
    const struct bd_frame_request *frame = &job->request.frame;
    const struct bd_report *report = &job->result.report;
    if (frame->budget_ms > 0) {
        // The report has the time of the frames before it, too.
        const double spent_ms = frame_ms(report), ms = spent_ms - job->improved_ms;
        const double left_ms = frame->budget_ms - spent_ms;
        job->improved_ms = spent_ms;
        job->budget_ends_ns =
            bd_clock_ns() + (uint64_t)(1e6 * bd_improve_patience_ms(frame->budget_ms, spent_ms));
        return bd_improve_rungs_for_ms(frame, report, ms, left_ms);
    }
    return judges_itself(job) ? bd_improve_rungs_for_estimate(estimate_of(report)) : 0;
}

// Those up to the ladder's end. Who was judged by one sub-frame is not judged again.
bool bd_improve_take(struct bd_job *job)
{
    struct bd_frame_request *frame = &job->request.frame;
    struct bd_param_list better;
    if (job->result.err || job->is_settled || frame->plan_only) return false;
    if (job->asked_width_px > 0) {
        follow_pilot(job);
        return true;
    }
    bd_report_add_time(&job->result.report.time_ms, &job->pilot_ms);
    job->pilot_ms = (struct bd_report_time){0};
    if (frame->budget_ms > 0) bd_report_flag(&job->result.report, "chosen_by_clock");
    const uint32_t rungs = rungs_of(job);
    const bool climbs = bd_ladder_above(technique_of(frame), &frame->params, rungs, &better) > 0;
    const bool is_judged = frame->aa > 1 && judges_itself(job);
    if (is_judged || !(climbs || job->asked_aa)) return false;
    bd_standby_keep_for(job, &better);
    if (job->asked_aa) frame->aa = job->asked_aa;
    job->asked_aa = 0;
    return true;
}
