// What a change of a scene makes a frame do again: the plan of before, the plan of after, and what
// each pass reads.
//
// By aspects of the scene, as the memo's keys have them, but told for a renderer that has just
// rendered the frame of before and lost nothing since. A pass that works for each light by itself
// counts as run again if it is for one. Any thread.

#ifndef BD_FRAME_INVALIDATE_H
#define BD_FRAME_INVALIDATE_H

#include "frame/report.h"
#include "frame/request.h"
#include "scene/model/scene.h"

struct bd_invalidation {
    uint32_t run_count, kept_count;
    const char *run[BD_REPORT_PASS_MAX]; // static texts, in the order of the frame
    const char *kept[BD_REPORT_PASS_MAX];
};

// Faults are those of bd_plan_make for `after`; where `before` could not be rendered so, everything
// runs.
BD_MUST_CHECK
enum bd_err bd_invalidate(const struct bd_scene *before, const struct bd_scene *after,
                          const struct bd_frame_request *request, struct bd_invalidation *out,
                          struct bd_err_detail *detail);

#endif
