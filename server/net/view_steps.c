#include "net/view_steps.h"

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

// Steps that add sub-frames. The reference has none: its samples are spread over the pixel.
static uint32_t sub_frame_steps(const struct bd_frame_request *request)
{
    uint32_t steps = 0;
    if (bd_frame_request_is_traced(request)) return 0;
    while (request->aa << steps < BD_VIEW_SUB_FRAMES) steps++;
    return steps;
}

static uint32_t sub_frames_of(const struct bd_frame_request *request, uint32_t step)
{
    uint32_t most = sub_frame_steps(request);
    uint32_t sub_frames = request->aa << (step < most ? step : most);
    return step > 0 && sub_frames > BD_VIEW_SUB_FRAMES && most > 0 ? BD_VIEW_SUB_FRAMES
                                                                   : sub_frames;
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
    struct bd_param_list ignored;
    const uint32_t first = bd_view_steps_before(request) + sub_frame_steps(request);
    return step <= first || climb(request, step - first, &ignored) == step - first;
}

bool bd_view_step_adds_sub_frames(const struct bd_frame_request *request, uint32_t step)
{
    const uint32_t before = bd_view_steps_before(request);
    return step > before && step <= before + sub_frame_steps(request);
}

void bd_view_lay_step(const struct bd_frame_request *request, uint32_t step,
                      struct bd_frame_request *out)
{
    const uint32_t before = bd_view_steps_before(request),
                   first = before + sub_frame_steps(request);
    out->aa = sub_frames_of(request, step > before ? step - before : 0);
    if (step < before)
        bd_ladder_cheapest(bd_technique_for(request->technique, &request->params, NULL),
                           &request->params, &out->params);
    else
        climb(request, step > first ? step - first : 0, &out->params);
}
