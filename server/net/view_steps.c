#include "net/view_steps.h"

#include "frame/ladder.h"
#include "technique/technique.h"

// Steps taken, at most `step`; the parameters of the last of them.
static uint32_t climb(const struct bd_frame_request *request, uint32_t step,
                      struct bd_param_list *out)
{
    struct bd_params params;
    struct bd_param_list all, ignored;
    const char *name = request->technique[0] ? request->technique : "rsm";
    const struct bd_technique *technique = bd_technique_find(name, NULL);
    *out = request->params;
    if (step == 0 || !technique) return 0;
    if (bd_params_read(&request->params, technique, &params, NULL)) return 0;
    // Where on the ladder the request stands, its defaults included.
    bd_params_write(&params, technique, &all);
    uint32_t rung = bd_ladder_begin(technique, &all, &ignored), taken = 0;
    while (taken < step && bd_ladder_climb(technique, &request->params, &rung, out)) taken++;
    return taken;
}

bool bd_view_has_step(const struct bd_frame_request *request, uint32_t step)
{
    struct bd_param_list ignored;
    return climb(request, step, &ignored) == step;
}

void bd_view_lay_step(const struct bd_frame_request *request, uint32_t step,
                      struct bd_frame_request *out)
{
    climb(request, step, &out->params);
}
