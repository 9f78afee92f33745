// One frame: plan, upload, light-side passes, camera-side passes, composite, readback.
//
// The renderer keeps the device's uploads and the memo of passes between frames; a frame itself
// is a function of snapshot, request and seed.
//
// Thread: render thread.

#ifndef BD_FRAME_FRAME_H
#define BD_FRAME_FRAME_H

#include "frame/memo.h"
#include "frame/plan.h"
#include "frame/report.h"
#include "frame/request.h"
#include "gpu/gpu.h"
#include "image/image.h"
#include "pass/slicer.h"
#include "upload/gpu_scene.h"

struct bd_renderer {
    struct bd_gpu *gpu; // borrowed
    struct bd_uploader uploader;
    struct bd_memo *memo;
    struct bd_slicer slicer;
};

// `memo_budget_bytes` bounds what is kept between frames, not what one frame may use.
void bd_renderer_init(struct bd_renderer *renderer, struct bd_gpu *gpu,
                      uint64_t memo_budget_bytes);
// Destroys everything on the device; call while the context still stands, or is lost.
void bd_renderer_finish(struct bd_renderer *renderer);

// Renders the requested layers into `layers` (the caller destroys them; all NULL on failure) and
// fills the report, also on failure as far as it came. `should_stop` is asked between slices.
BD_MUST_CHECK
enum bd_err bd_frame_render(struct bd_renderer *renderer, struct bd_scene *scene,
                            const struct bd_frame_request *request,
                            enum bd_err (*should_stop)(void *user), void *user,
                            struct bd_image *layers[BD_LAYER_COUNT], struct bd_report *report,
                            struct bd_fault *fault);

#endif
