// The stages of a frame: each is one pass with its key. A stage looks its output up in the memo;
// if it is there the pass is reported as reused, otherwise it runs and its output is kept.
//
// Private to frame/.

#ifndef BD_FRAME_STAGES_H
#define BD_FRAME_STAGES_H

#include "frame/frame.h"
#include "pass/composite.h"
#include "pass/direct.h"
#include "pass/fragments.h"
#include "pass/gather.h"
#include "pass/rsm.h"
#include "pass/shadow_map.h"
#include "pass/surfaces.h"
#include "pass/vpl_clusters.h"
#include "pass/vpl_grid.h"
#include "pass/vpl_tree.h"

// A light of the frame and what was made for it. Keys name the outputs.
struct bd_frame_light {
    struct bd_light_setup setup;
    uint32_t grid_side, rsm_size;
    uint64_t shadow_key, rsm_key, vpl_key;
    struct bd_shadow_map *shadow_map;
    struct bd_rsm *rsm;
    struct bd_vpl_list *vpls;
    struct bd_vpl_tree *tree;
};

// What a sub-frame was made of. Outputs are the memo's.
struct bd_sub_frame {
    struct bd_viewpoint viewpoint;
    struct bd_gbuffer *gbuffer;
    struct bd_indirect *indirect;
};

// What indirect light a frame has, over all of its sub-frames.
struct bd_indirect_counts {
    uint64_t fragments, subsplats, subsplats_tested, subsplats_split;
    bool subsplats_limited; // in some sub-frame
};

// A frame's layers, added up over its sub-frames so far.
struct bd_frame_sums {
    uint32_t count;
    struct bd_tex *layers[BD_LAYER_COUNT]; // RGBA32F; NULL: not asked for
    struct bd_indirect_counts counts;
};

struct bd_frame {
    struct bd_renderer *renderer;
    struct bd_pass_context context;
    struct bd_scene *snapshot;
    const struct bd_frame_request *request;
    const struct bd_plan *plan;
    struct bd_report *report;
    struct bd_fault *fault;

    bool is_camera_side; // of a light's otherwise
    bool anew;           // what earlier frames made is not taken over; set side by side
    struct bd_gpu_scene *scene;
    uint32_t light_count;
    struct bd_frame_light *lights;

    struct bd_viewpoint viewpoint; // of the current sub-frame
    uint64_t gbuffer_key, direct_key, discontinuity_key, fragments_key, surfaces_key, indirect_key;
    struct bd_gbuffer *gbuffer;
    struct bd_tex *direct;
    struct bd_discontinuity *discontinuity;
    struct bd_fragments *fragments;
    struct bd_surfaces *surfaces;
    struct bd_indirect *indirect;

    struct bd_sub_frame first; // of several: what the others share
    uint64_t sums_key;

    // While it was set aside, what others took.
    double away_ms, away_compile_ms, away_upload_ms;
};

enum bd_err bd_stage_upload(struct bd_frame *frame);
enum bd_err bd_stage_shadow_map(struct bd_frame *frame, struct bd_frame_light *light);
enum bd_err bd_stage_rsm(struct bd_frame *frame, struct bd_frame_light *light);
enum bd_err bd_stage_vpl_grid(struct bd_frame *frame, struct bd_frame_light *light);
enum bd_err bd_stage_vpl_clusters(struct bd_frame *frame, struct bd_frame_light *light);
enum bd_err bd_stage_vpl_tree(struct bd_frame *frame, struct bd_frame_light *light);
enum bd_err bd_stage_gbuffer(struct bd_frame *frame);
enum bd_err bd_stage_direct(struct bd_frame *frame);
enum bd_err bd_stage_discontinuity(struct bd_frame *frame);
enum bd_err bd_stage_fragments(struct bd_frame *frame);
enum bd_err bd_stage_surfaces(struct bd_frame *frame);
enum bd_err bd_stage_indirect(struct bd_frame *frame);

// From the first sub-frame's, instead of all from discontinuity to indirect.
enum bd_err bd_stage_shared_indirect(struct bd_frame *frame);

// The sums of as many sub-frames as earlier frames of the same view, layers and parameters added
// up, but no more than this one asks for; or of none. The first sub-frame's stages were run. They
// are this frame's alone until kept, or destroyed where they are not `whole`.
enum bd_err bd_stage_take_sums(struct bd_frame *frame, struct bd_frame_sums **out);
void bd_stage_keep_sums(struct bd_frame *frame, struct bd_frame_sums **sums, bool whole);

// Before another sub-frame is seen: this one's outputs stay in the memo.
void bd_stage_leave_camera_side(struct bd_frame *frame);
// Ends a second or later sub-frame of an antialiased frame: its light is in the sum, and nobody
// asks for what it was made of again.
void bd_stage_forget_camera_side(struct bd_frame *frame);

// Marks a planned pass in the report. A pass that ran for one light or sub-frame and was reused for
// another ran.
void bd_stage_mark(struct bd_frame *frame, const char *pass, enum bd_pass_state state);

#endif
