// Running the stages of a frame (frame/stage_rows.h). A stage looks its output up in the memo; if
// it is there its passes are reported as reused, otherwise it runs and its output is kept.
//
// Private to frame/.

#ifndef BD_FRAME_STAGES_H
#define BD_FRAME_STAGES_H

#include "frame/frame.h"
#include "frame/stage_rows.h"
#include "lights/area_lights.h"
#include "lights/punctual_tree.h"
#include "pass/area_direct.h"
#include "pass/composite.h"
#include "pass/direct.h"
#include "pass/env_maps.h"
#include "pass/first_light.h"
#include "pass/fragments.h"
#include "pass/gather.h"
#include "pass/imperfect_shadows.h"
#include "pass/light_paths.h"
#include "pass/lit_points.h"
#include "pass/photons.h"
#include "pass/rsm.h"
#include "pass/shadow_map.h"
#include "pass/surfaces.h"
#include "pass/vpl_clusters.h"
#include "pass/vpl_grid.h"
#include "pass/vpl_tree.h"

// What a sub-frame was made of. Outputs are the memo's.
struct bd_sub_frame {
    struct bd_viewpoint viewpoint;
    struct bd_pixel_blocks blocks; // of the picture, that are its pixels
    struct bd_gbuffer *gbuffer;
    struct bd_indirect *indirect;
};

// What indirect light a frame has, over all of its sub-frames.
struct bd_indirect_counts {
    uint64_t fragments, subsplats, subsplats_tested, subsplats_split, screen_parts, rays;
    double rays_ms;
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
    struct bd_err_detail *detail;

    bool is_camera_side; // of a light's otherwise
    bool anew;           // what earlier frames made is not taken over; set side by side
    struct bd_gpu_scene *scene;
    struct bd_surface_hits panes; // of the snapshot, where who looks for lights looks through them
    struct bd_occluders *occluders;
    struct bd_tracer tracer;            // of them
    struct bd_area_lights *emitters;    // and the sky
    struct bd_punctual_tree *lamps;     // that have no maps
    struct bd_light_paths *light_paths; // from them
    struct bd_env_maps *env_maps;       // instead of triangles
    struct bd_photons *photons;         // from them, and from lamps that have maps
    struct bd_lit_points *points;       // lit by both
    struct bd_vpl_list *order;          // the VPLs of all lights
    struct bd_shadow_points *shadow_points;
    struct bd_imperfect_shadows *imperfect_shadows; // of VPLs that are gathered
    uint64_t rests_on; // the key of what the stage that runs makes its output of; 0: of nothing
    struct bd_subject subject; // its viewpoint: of the current sub-frame

    // Of the current sub-frame: the keys of its stages that ran, and their outputs.
    uint64_t keys[BD_STAGE_COUNT];
    struct bd_made made;
    // Of what a later round than the first made for itself.
    uint64_t round_keys[2 * BD_STAGE_COUNT];
    uint32_t round_key_count;

    struct bd_sub_frame first; // of several, or of blocks: whose light the others share
    uint64_t sums_key;

    // While it was set aside, what others took.
    double away_ms, away_compile_ms, away_upload_ms;
};

enum bd_err bd_stage_upload(struct bd_frame *frame);

// Runs a stage, or takes its output over; nothing where the plan does not have it. `light` is NULL
// but for stages of lights. Stages that it is made from come first.
enum bd_err bd_stage_run(struct bd_frame *frame, enum bd_stage stage, struct bd_frame_light *light);

// How each is run: the rows' column. Those that sched/ runs have none.
#define X(NAME, name)                                                                              \
    enum bd_err bd_run_##name(struct bd_frame *frame, struct bd_frame_light *light);
BD_STAGES(X)
#undef X

// The sums of as many sub-frames as earlier frames of the same view, layers and parameters added
// up, but no more than this one asks for; or of none. The first sub-frame's stages were run. They
// are this frame's alone until kept, or destroyed where they are not `whole`.
enum bd_err bd_stage_take_sums(struct bd_frame *frame, struct bd_frame_sums **out);
void bd_stage_keep_sums(struct bd_frame *frame, struct bd_frame_sums **sums, bool whole);

// Who finds what so many samples see; NULL: all is drawn.
const struct bd_tracer *bd_stage_tracer(struct bd_frame *frame, uint64_t samples);

// Rays that look for lights with a size.
struct bd_visibility_inputs bd_stage_light_visibility(const struct bd_frame *frame);
// All punctual lights, in render space and the frame's unit; the caller's.
struct bd_light_uniform *bd_stage_punctuals(const struct bd_frame *frame);
// Lists of VPLs, how many there are and may be: one a light that has maps, and those of the light
// paths, which come last.
uint32_t bd_stage_lists(const struct bd_frame *frame, const struct bd_vpl_list **lists);
uint32_t bd_stage_lists_most(const struct bd_frame *frame);
// Those of them that pixels gather from, or the one that they choose from.
uint32_t bd_stage_gathered_lists(const struct bd_frame *frame, const struct bd_vpl_list **lists);
// Trees over them, where the technique has any.
void bd_stage_trees(const struct bd_frame *frame, const struct bd_vpl_tree **trees);

// Before another sub-frame is seen: this one's outputs stay in the memo.
void bd_stage_leave_camera_side(struct bd_frame *frame);
// Ends a second or later sub-frame of an antialiased frame: its light is in the sum, and nobody
// asks for what it was made of again.
void bd_stage_forget_camera_side(struct bd_frame *frame);

// Of a later round than the first: what the stages made that ran since the camera's side was left
// last, from the lights' side on, is no other round's; and the end of all that, of which nobody
// asks for anything again.
void bd_stage_note_round(struct bd_frame *frame);
void bd_stage_forget_round(struct bd_frame *frame);

// Marks a planned pass in the report. A pass that ran for one light or sub-frame and was reused for
// another ran.
void bd_stage_mark(struct bd_frame *frame, const char *pass, enum bd_pass_state state);

#endif
