// The plan: what a frame needs and, in plain words, what it leaves out and why.
//
// Made from the request and the scene's features alone, before anything touches the device; the
// frame then follows it and decides nothing by itself. `--plan` prints it. Any thread.

#ifndef BD_FRAME_PLAN_H
#define BD_FRAME_PLAN_H

#include <stdbool.h>

#include "frame/report.h"
#include "frame/request.h"
#include "lights/interface.h"
#include "scene/model/scene.h"
#include "technique/technique.h"
#include "upload/light_setup.h"

// Of what cameras and lights see, what is found by rays.
enum bd_tracing {
    BD_TRACING_NONE,
    BD_TRACING_WHERE_MANY, // triangles are: more than samples
    BD_TRACING_ALL,
};

struct bd_plan {
    const struct bd_technique *technique;
    struct bd_params params;
    int32_t camera;       // placed camera
    uint32_t stages;      // bits of enum bd_stage (frame/stage_rows.h)
    bool rig_yields;      // the default lights do, to what else shines
    bool area_lights;     // some surface emits or some sky shines, and lights
    bool emitters, sky;   // which of them
    bool light_paths;     // surfaces send that on, what has no maps, or any more than once
    bool final_gather;    // the technique has one: there are light paths, in two sets
    bool images;          // environment maps answer its rays
    bool points;          // the technique has those, with their light; and no light paths
    bool follows;         // it follows light itself: by either, or a final gather
    bool photons;         // the technique has those, where they landed; and no light paths
    bool from_screen;     // what falls on surfaces that are seen is asked for, and sent on
    bool short_rays;      // bring what a clamp takes off
    uint32_t bounces;     // of indirect light
    bool indirect;        // the technique's indirect light runs
    bool rays;            // hide indirect light, or a final gather's
    bool imperfect;       // shadow maps of VPLs hide it
    bool chosen;          // some VPLs alone are asked, since there are more of them than rays
    bool filtered;        // what few rays leave noisy
    bool in_rounds;       // something is decided by chance: drawn anew by each round (sub_frames.h)
    // Something is decided by chance, and every pixel knows how far off that is. Leaves the layers
    // noise and blur, which go no further than the report's own_estimate unless they are asked for.
    bool doubts;
    bool shared;          // of several sub-frames all but the first take its indirect light over
    uint32_t block_px; // pixels along a side of blocks whose light all of them take over; 1: none
    bool blends;       // what blends is in as many sub-frames as it is opaque
    bool normal_maps;     // some surface has one
    bool native;          // passes that have loops for the processor run them (bd_plan_place)
    bool glossy;          // receivers with a specular lobe worth its price
    bool rough;           // and others, whose lobes get a few rays all the same
    bool glass;           // some surface lets light through, and the technique knows
    bool panes;           // who looks for lights looks straight through glass, of this kind:
    enum bd_straight straight;
    bool veils;           // and through what blends, as far as it is not opaque
    bool shows_glass;     // of which rays of a stage's own bring what is behind it
    bool goes_on;         // rays and photons do, from that or from mirrors
    bool caustics;        // lamps send light to either, and photons bring it
    bool emission;        // some surface emits or is unlit
    // There is indirect light, and nothing in the scene hides any of it. With auto_exposure such a
    // frame makes the layers direct and emission too, since its brightness is measured on them;
    // they go no further than the encoder.
    bool unoccluded;
    uint32_t layers;      // that are made: the request's, beauty, and what auto exposure reads
    uint32_t light_count; // that are punctual and shine
    bool punctuals_by_rays; // without maps: area_light has their light, light_paths what is sent on
    double flux_lm;       // of all of them
    // Follows from request and scene, until bd_plan_place. Keys of `seen`, `shadow_map` and `rsm`
    // hold what it comes to, and `bvh` then reads SIDES, since rays pass backs by.
    enum bd_tracing tracing;
    uint32_t traced_stages;  // bits of those that do it, of some light
    uint64_t triangle_count; // of the scene, instanced
};

// Also fills the parts of `report` that are known now: request, parameters, planned passes, what
// is omitted, flags of the scene and of what the technique cannot honour.
BD_MUST_CHECK
enum bd_err bd_plan_make(const struct bd_scene *scene, const struct bd_frame_request *request,
                         struct bd_plan *out, struct bd_report *report,
                         struct bd_err_detail *detail);

// Triangles of a scene up to which they are drawn, however few samples there are: that takes a
// software device less than a tenth of a second.
#define BD_PLAN_DRAWN_MAX (UINT64_C(1) << 18)

// Whether what so many samples see is found by rays. Counts alone decide: the same request has the
// same bytes, whatever was made before.
bool bd_plan_traces(const struct bd_plan *plan, uint64_t samples);

// Pixels along a side of the blocks that a picture of that size and so many sub-frames is lit by;
// 1: none. Counts alone decide.
uint32_t bd_plan_block_px(const struct bd_technique *technique, const struct bd_params *params,
                          uint32_t width_px, uint32_t height_px, uint32_t aa);

// Decides who does the arithmetic, on that kind of device; until then the plan is a software one's.
// BD_EXECUTOR of the environment, "device" or "native", is what `auto` means: so every test runs
// with either.
void bd_plan_place(struct bd_plan *plan, bool device_is_software, struct bd_report *report);

static inline bool bd_plan_reads(const struct bd_plan *plan, enum bd_param param)
{
    return plan->technique->params_read >> param & 1;
}

// Whether a placed light has any power, and does not yield; one that has none costs no pass.
bool bd_plan_light_shines(const struct bd_plan *plan, const struct bd_scene *scene,
                          uint32_t placed_light);

// VPLs along one face's side of a light, after `vpl_budget`; at least 1. For clusters, those of the
// coarsest blocks; there and for trees the nearest power of two.
uint32_t bd_plan_grid_side(const struct bd_plan *plan, const struct bd_light_setup *light);

// Most clusters of a light: its share, by flux, of a `vpl_budget` that is told, and those that
// nothing is split for at least; 0: as many as there are.
uint32_t bd_plan_clusters_most(const struct bd_plan *plan, const struct bd_light_setup *light,
                               uint32_t grid_side);

// Roots of a light's tree along a face's side, for so many leaves along it.
uint32_t bd_plan_tree_root_side(const struct bd_plan *plan, const struct bd_light_setup *light,
                                uint32_t grid_side);

// Some VPLs of a list are asked. A tree is in order by itself, and so is what a final gather asks.
static inline bool bd_plan_gathers_in_order(const struct bd_plan *plan)
{
    return plan->chosen && !(plan->technique->inputs & (BD_INPUT_VPL_TREE | BD_INPUT_FINAL_GATHER));
}

// Rays that look for lights, or for what is seen, ask the processor, whatever the device.
static inline bool bd_plan_asks_processor(const struct bd_plan *plan)
{
    return plan->area_lights || plan->punctuals_by_rays || plan->shows_glass ||
           plan->tracing != BD_TRACING_NONE;
}

// VPLs of light paths; 0 where there are none, and for a final gather without a sky. For trees a square of
// a power of two. And roots along a side of their tree; 0 where the technique has none.
uint32_t bd_plan_light_path_count(const struct bd_plan *plan);
// Beside them, for a final gather: photons of all punctual lights, and of all emitters.
uint32_t bd_plan_photon_vpl_count(const struct bd_plan *plan);
uint32_t bd_plan_light_path_root_side(const struct bd_plan *plan);

// Most texels along a side of the block that one VPL sums up. One work group reads them all, three
// times, and cannot be stopped: this keeps it at 0.1 s on the software device.
#define BD_PLAN_BLOCK_TEXELS_MAX 1024

// Texels along one face's side of the map that a grid is made from: `rsm_size`, less where the
// light has fewer VPLs for its budget, held to between 1 and BD_PLAN_BLOCK_TEXELS_MAX for each VPL
// along the side. Where it is held to the latter, the plan says so.
uint32_t bd_plan_rsm_size(const struct bd_plan *plan, const struct bd_light_setup *light,
                          uint32_t grid_side);

#endif
