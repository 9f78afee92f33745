#include "net/live/view_steps.h"

#include <string.h>

#include "frame/ladder.h"
#include "technique/technique.h"

// Steps taken, at most `step`; the parameters of the last of them, which may be a shorter one.
static uint32_t climb(const struct bd_frame_request *request, uint32_t step,
                      struct bd_param_list *out)
{
    const struct bd_technique *technique =
        bd_technique_for(request->technique, &request->params, NULL);
    *out = request->params;
    if (!technique) return 0;
    const uint32_t at_once = technique->view_rungs > 1 ? technique->view_rungs : 1;
    const uint32_t most = UINT32_MAX / at_once;
    const uint32_t rungs = at_once * (step < most ? step : most);
    return (bd_ladder_above(technique, &request->params, rungs, out) + at_once - 1) / at_once;
}

// Doublings from so many sub-frames to so many. The reference has none: its samples are spread over
// the pixel.
static uint32_t doublings(const struct bd_frame_request *request, uint32_t from, uint32_t to)
{
    uint32_t count = 0;
    if (bd_frame_request_is_traced(request)) return 0;
    while (from << count < to) count++;
    return count;
}

static uint32_t doubled(uint32_t sub_frames, uint32_t times, uint32_t most)
{
    return sub_frames >= most || sub_frames << times < most ? sub_frames << times : most;
}

// What comes after the cheapest settings: sub-frames, rungs but for the last, sub-frames, and the
// last rung, or rounds of sub-frames.
struct parts {
    uint32_t smooth, climb, finish, last, rounds;
};

// Rounds draw anew what it decides by chance. They take the last rung's place: in as much time they
// are as near to the truth (side spot, 10 s: 1.87 % off, 1.89 by the last rung), and go on.
static bool draws_anew(const struct bd_frame_request *request)
{
    const struct bd_technique *technique =
        bd_technique_for(request->technique, &request->params, NULL);
    return technique && technique->is_sampled && !technique->is_reference;
}

static struct parts parts_of(const struct bd_frame_request *request)
{
    struct bd_param_list ignored;
    const uint32_t rungs = climb(request, UINT32_MAX, &ignored);
    struct parts parts = {.smooth = doublings(request, request->aa, BD_VIEW_SUB_FRAMES),
                          .climb = rungs > 0 ? rungs - 1 : 0,
                          .last = rungs > 0 && !draws_anew(request)};
    parts.finish = doublings(request, parts.smooth ? BD_VIEW_SUB_FRAMES : request->aa,
                             BD_VIEW_SUB_FRAMES_OF_LIGHT);
    if (draws_anew(request))
        parts.rounds = doublings(
            request,
            request->aa > BD_VIEW_SUB_FRAMES_OF_LIGHT ? request->aa : BD_VIEW_SUB_FRAMES_OF_LIGHT,
            BD_VIEW_SUB_FRAMES_MOST);
    return parts;
}

uint32_t bd_view_steps_before(const struct bd_frame_request *request)
{
    struct bd_param_list ignored;
    const struct bd_technique *technique =
        bd_technique_for(request->technique, &request->params, NULL);
    return technique && bd_technique_is_auto(request->technique) &&
           bd_ladder_cheapest(technique, &request->params, &ignored);
}

bool bd_view_has_step(const struct bd_frame_request *request, uint32_t step)
{
    const struct parts parts = parts_of(request);
    return step <= bd_view_steps_before(request) + parts.smooth + parts.climb + parts.finish +
                       parts.last + parts.rounds;
}

bool bd_view_step_adds_sub_frames(const struct bd_frame_request *request, uint32_t step)
{
    const struct parts parts = parts_of(request);
    const uint32_t first = bd_view_steps_before(request), then = first + parts.smooth + parts.climb;
    return (step > first && step <= first + parts.smooth) ||
           (step > then && step <= then + parts.finish) || bd_view_step_draws_anew(request, step);
}

bool bd_view_step_draws_anew(const struct bd_frame_request *request, uint32_t step)
{
    const struct parts parts = parts_of(request);
    return parts.rounds > 0 &&
           step > bd_view_steps_before(request) + parts.smooth + parts.climb + parts.finish;
}

static uint32_t at_most(uint32_t *left, uint32_t most)
{
    const uint32_t taken = *left < most ? *left : most;
    *left -= taken;
    return taken;
}

void bd_view_lay_step(const struct bd_frame_request *request, uint32_t step,
                      struct bd_frame_request *out)
{
    const struct parts parts = parts_of(request);
    const uint32_t before = bd_view_steps_before(request);
    uint32_t left = step > before ? step - before : 0;
    out->aa = doubled(request->aa, at_most(&left, parts.smooth), BD_VIEW_SUB_FRAMES);
    uint32_t rungs = at_most(&left, parts.climb);
    out->aa = doubled(out->aa, at_most(&left, parts.finish), BD_VIEW_SUB_FRAMES_OF_LIGHT);
    out->aa = doubled(out->aa, at_most(&left, parts.rounds), BD_VIEW_SUB_FRAMES_MOST);
    rungs += at_most(&left, parts.last);
    if (step < before)
        bd_ladder_cheapest(bd_technique_for(request->technique, &request->params, NULL),
                           &request->params, &out->params);
    else
        climb(request, rungs, &out->params);
}

// --- what a next step costs ------------------------------------------------------------------

// Whether sub-frames have light of their own: of a frame of several that shares none.
static bool shares_nothing(const struct bd_report *report)
{
    for (uint32_t i = 0; i < report->pass_count; i++)
        if (strcmp(report->passes[i].name, "share") == 0) return false;
    return report->aa > 1;
}

void bd_view_cost_learn(struct bd_view_cost *cost, const struct bd_report *report, bool is_rung)
{
    double each_ms = 0, once_ms = 0;
    const bool all_are_own = shares_nothing(report);
    for (uint32_t i = 0; i < report->pass_count; i++) {
        const double ms = report->passes[i].ms;
        const uint32_t sub_frames = report->passes[i].sub_frames;
        if (report->passes[i].state != BD_PASS_RAN) continue;
        if (sub_frames > 0 && (all_are_own || report->passes[i].of_each_sub_frame))
            each_ms += ms / sub_frames;
        else
            once_ms += ms;
    }
    if (each_ms > 0) cost->sub_frame_ms = each_ms;
    // What was taken over from an earlier frame says nothing of what the next one takes.
    if (is_rung && (once_ms > cost->once_ms || report->aa == 1)) cost->once_ms = once_ms;
}

static uint32_t rounds_of(uint32_t sub_frames)
{
    return bd_round_of(sub_frames - 1) + 1;
}

double bd_view_cost_of_sub_frames(const struct bd_view_cost *cost, uint32_t from, uint32_t to)
{
    return (to - from) * cost->sub_frame_ms + (rounds_of(to) - rounds_of(from)) * cost->once_ms;
}

double bd_view_cost_of_rung(const struct bd_view_cost *cost, uint32_t sub_frames)
{
    return BD_VIEW_RUNG_RATIO * cost->once_ms + sub_frames * cost->sub_frame_ms;
}
