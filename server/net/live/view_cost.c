#include "net/live/view_cost.h"

#include <string.h>

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

double bd_view_cost_of_sub_frames(const struct bd_view_cost *cost, uint32_t count)
{
    return count * cost->sub_frame_ms;
}

double bd_view_cost_of_rung(const struct bd_view_cost *cost, uint32_t sub_frames)
{
    return BD_VIEW_RUNG_RATIO * cost->once_ms + sub_frames * cost->sub_frame_ms;
}
