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
#include "pass/occluders.h"
#include "pass/pass.h"
#include "pass/slicer.h"
#include "upload/gpu_scene.h"

struct bd_frame;

struct bd_renderer {
    struct bd_gpu *gpu; // borrowed
    struct bd_uploader uploader;
    struct bd_memo *memo;
    struct bd_slicer slicer;
    struct bd_pool *pool; // for rays and native passes; NULL before the first of them
    struct bd_processor processor;
    enum bd_rays_executor rays_on; // for tests; set before the first frame
    struct bd_frame *frame; // that is being rendered; NULL between frames
};

// `memo_budget_bytes` bounds what is kept between frames, not what one frame may use.
void bd_renderer_init(struct bd_renderer *renderer, struct bd_gpu *gpu,
                      uint64_t memo_budget_bytes);
// Destroys everything on the device; call while the context still stands, or is lost.
void bd_renderer_finish(struct bd_renderer *renderer);

// Its threads beside the caller's.
struct bd_pool *bd_renderer_pool(struct bd_renderer *renderer);

// Renders the requested layers into `layers` (the caller destroys them; all NULL on failure) and
// fills the report, also on failure as far as it came. `should_stop` is asked between slices. Times
// in the report are the frame's own: without those for which it was set aside.
BD_MUST_CHECK
enum bd_err bd_frame_render(struct bd_renderer *renderer, struct bd_scene *scene,
                            const struct bd_frame_request *request,
                            enum bd_err (*should_stop)(void *user), void *user,
                            struct bd_image *layers[BD_LAYER_COUNT], struct bd_report *report,
                            struct bd_err_detail *detail);

// A frame set aside between two of its slices: what it has made stays on the device.
struct bd_suspended_frame {
    struct bd_frame *frame;
    struct bd_gpu_suspended gpu;
    struct bd_slicer slicer;
    double compile_ms, upload_ms, light_unit_cd_m2;
    uint64_t since_ns;
};

// Frames that may be under way at once, one being rendered and the others set aside.
#define BD_FRAMES_MAX BD_MEMO_FRAMES_MAX

// Called within a frame's `should_stop`: sets it aside, so that others may be rendered with
// bd_frame_render, one after the other; then resume, and the frame goes on as if nothing had been.
// Its bytes are the same. A device that was lost in between is told by the next slice.
//
// What makes that safe: passes bind all their state at each call; the pass and the target that are
// being recorded are put away (bd_gpu_suspend); the memo keeps what any frame under way uses, and
// hides from others what one of them forgot; meshes and textures are shared once they are uploaded
// as a whole.
void bd_renderer_suspend(struct bd_renderer *renderer, struct bd_suspended_frame *out);
void bd_renderer_resume(struct bd_renderer *renderer, const struct bd_suspended_frame *suspended);

#endif
