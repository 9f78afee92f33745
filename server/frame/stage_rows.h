// The stages of a frame, a row each: which passes they are in the report, who needs them, what
// they read. The plan, what it leaves out, the memo's keys, the report and a dry run follow from
// the rows; frame.c says in which order they run.
//
// A stage makes one output, of a light or of a sub-frame, whose key is the hash of everything that
// it is made from: what the row says that it reads, and the keys of the stages that it is made
// from. BD_STAGE_SEEN has no pass and no output: it is the part of the G-buffer that says where
// surfaces are and which way they face, so that who reads no more than that is not made anew for a
// colour.
//
// Private to frame/. Keys and plans: any thread.

#ifndef BD_FRAME_STAGE_ROWS_H
#define BD_FRAME_STAGE_ROWS_H

#include "frame/plan.h"

// X(NAME, name): all of them, in the order of the report, which is also that in which those of a
// sub-frame run.
#define BD_STAGES(X)                                                                               \
    X(BVH, bvh) /* of the reference, with the next two: sched/ runs them */                        \
    X(TRACE, trace)                                                                                \
    X(FILTER, filter)                                                                              \
    X(SEEN, seen)                                                                                  \
    X(GBUFFER, gbuffer)                                                                            \
    X(SHADOW_MAP, shadow_map)                                                                      \
    X(DIRECT, direct)                                                                              \
    X(RAYS, rays)                                                                                  \
    X(EMITTERS, emitters) /* and the sky */                                                        \
    X(LAMPS, lamps)       /* that are too many for maps */                                         \
    X(AREA_LIGHT, area_light)                                                                      \
    X(RSM, rsm)                                                                                    \
    X(VPL_GRID, vpl_grid)                                                                          \
    X(VPL_CLUSTERS, vpl_clusters)                                                                  \
    X(VPL_TREE, vpl_tree)                                                                          \
    X(LIGHT_PATHS, light_paths) /* from emitters and the sky */                                    \
    X(ENV_MAPS, env_maps)                                                                          \
    X(PHOTONS, photons)                                                                            \
    X(POINTS, points)       /* of surfaces, lit */                                                 \
    X(VPL_ORDER, vpl_order) /* of all lights */                                                    \
    X(SHADOW_POINTS, shadow_points)                                                                \
    X(IMPERFECT_SHADOWS, imperfect_shadows) /* of VPLs */                                          \
    X(DISCONTINUITY, discontinuity)                                                                \
    X(FRAGMENTS, fragments)                                                                        \
    X(SURFACES, surfaces)                                                                          \
    X(INDIRECT, indirect) /* the technique's own passes */                                         \
    X(SHARE, share)       /* the same for later sub-frames, from the first one's */                \
    X(GLASS, glass)       /* as it is seen, where the technique has no rays for that */            \
    X(COMPOSITE, composite)                                                                        \
    X(READBACK, readback)

enum bd_stage {
#define X(NAME, name) BD_STAGE_##NAME,
    BD_STAGES(X)
#undef X
        BD_STAGE_COUNT
};

#define BD_STAGE_BIT(name) (1u << BD_STAGE_##name)

// What is read that no stage made, beside aspects of the scene, whose bits come first.
enum bd_stage_read {
    BD_READ_LIGHT_SHAPE = 1u << BD_ASPECT_COUNT, // where it is and where to, not how bright
    BD_READ_LIGHT_POWER = 2u << BD_ASPECT_COUNT,
    BD_READ_LIGHT_SIDES = 4u << BD_ASPECT_COUNT, // how fine its maps and grids are
    BD_READ_VIEW = 8u << BD_ASPECT_COUNT,
    BD_READ_EMISSION_UNIT = 16u << BD_ASPECT_COUNT, // the frame's, where something emits
    BD_READ_SEED = 32u << BD_ASPECT_COUNT,          // where VPLs are chosen by chance
    BD_READ_LIGHT_SEED = 64u << BD_ASPECT_COUNT,    // of rays to lights
    BD_READ_UNIT = 128u << BD_ASPECT_COUNT,         // the frame's, whatever emits
    BD_READ_PATH_COUNT = 256u << BD_ASPECT_COUNT,   // of light paths, whether in a tree, or clamped
    // Whether rays find what is seen: by the camera, in a shadow map, in a reflective one.
    BD_READ_VIEW_TRACING = 512u << BD_ASPECT_COUNT,
    BD_READ_SHADOW_TRACING = 1024u << BD_ASPECT_COUNT,
    BD_READ_RSM_TRACING = 2048u << BD_ASPECT_COUNT,
    BD_READ_CLUSTERS_MOST = 4096u << BD_ASPECT_COUNT,
    BD_READ_PHOTON_SEED = 8192u << BD_ASPECT_COUNT,  // of photons, for a final gather
    BD_READ_ALONE = 16384u << BD_ASPECT_COUNT,       // whether there are other sub-frames
    BD_READ_FALLEN = 32768u << BD_ASPECT_COUNT,      // whether irradiance is asked for, too
    BD_READ_ENV_TRACING = 65536u << BD_ASPECT_COUNT, // in environment maps, as above
};

struct bd_frame;
struct bd_vpl_list;

// A light of the frame and what was made for it. Outputs are the memo's.
struct bd_frame_light {
    struct bd_light_setup setup;
    uint32_t grid_side, rsm_size, clusters_most;
    uint64_t keys[BD_STAGE_COUNT];
    struct bd_shadow_map *shadow_map;
    struct bd_rsm *rsm;
    struct bd_vpl_list *vpls;
    struct bd_vpl_tree *tree;
};

// What keys are about: a plan, a snapshot, the lights that shine in it and a sub-frame's viewpoint.
struct bd_subject {
    const struct bd_scene *scene;
    const struct bd_plan *plan;
    double unit_cd_m2;
    uint64_t seed;  // of its round (frame/sub_frames.h)
    uint32_t round; // of sub-frames
    bool alone; // the frame has one sub-frame
    uint32_t light_count;
    struct bd_frame_light *lights;
    struct bd_viewpoint viewpoint;
};

// What of its output there is one for.
enum bd_stage_of {
    BD_STAGE_OF_FRAME,  // one, whoever looks; or none that is kept
    BD_STAGE_OF_LIGHT,  // one a light
    BD_STAGE_OF_WHOLE,  // one a sub-frame that has light of its own
    BD_STAGE_OF_EACH,   // one a sub-frame
    BD_STAGE_OF_SHARER, // one a sub-frame that takes its light from the first one's
};

// A part of a pass that a frame may do without, in plain words.
struct bd_stage_part {
    bool (*is_left_out)(const struct bd_plan *plan, const struct bd_features *features);
    const char *why_not; // NULL: the list's end
};

struct bd_stage_row {
    const char *pass; // in the report; NULL: none, or the technique's own
    const char *second_pass; // or NULL
    enum bd_stage_of of;
    bool (*is_needed)(const struct bd_plan *plan);
    // In plain words, where it is not; NULL: not worth a word.
    const char *(*why_not)(const struct bd_plan *plan);
    const struct bd_stage_part *parts;
    uint32_t from;         // stages whose output is read; those of lights of its light, or of all
    uint32_t reads;        // bits of aspects and enum bd_stage_read
    uint32_t glossy;       // the same, where receivers are glossy
    uint32_t glass;        // the same, where light goes through glass
    uint32_t walking;      // the same, where light is sent on more than once
    uint32_t gathering;    // the same, where rays of a final gather say what is sent on
    uint32_t tracing;      // the same, where rays find what is seen
    bd_param_set params;
    bool reads_all_params; // that the technique reads
    bool is_keyless;       // it runs in every frame
    bool brackets_itself;  // its passes, for the clock: it alone knows when each runs
    // Makes the output, and keeps it in the frame or its light at `output`, an offset.
    enum bd_err (*run)(struct bd_frame *frame, struct bd_frame_light *light);
    uint64_t (*bytes)(const void *output);
    void (*destroy)(void *renderer, void *output);
    size_t output;
};

extern const struct bd_stage_row bd_stage_rows[BD_STAGE_COUNT];

static inline bool bd_plan_has(const struct bd_plan *plan, enum bd_stage stage)
{
    return plan->stages >> stage & 1;
}

// Names of a stage's passes in the report, at most BD_STAGE_PASSES_MAX; returns how many.
#define BD_STAGE_PASSES_MAX 10
uint32_t bd_stage_passes(const struct bd_plan *plan, enum bd_stage stage,
                         const char *names[BD_STAGE_PASSES_MAX]);

// With the viewpoint of the first of the request's sub-frames. `scene` and `plan` are borrowed.
struct bd_subject bd_subject_of(const struct bd_scene *scene, const struct bd_plan *plan,
                                const struct bd_frame_request *request);
void bd_subject_finish(struct bd_subject *subject);

// `light` is NULL but for stages of lights.
uint64_t bd_stage_key(const struct bd_subject *subject, enum bd_stage stage,
                      const struct bd_frame_light *light);

#endif
