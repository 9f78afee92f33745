// Parameters of techniques: KEY=VALUE text in, checked numbers out, and back into a report.
//
// One table (params.c) holds every parameter that any technique takes, with range and default; a
// technique names the ones it reads, and those whose default is another with it. A key that no
// technique knows, one that this technique does not read, and a value out of range are refused by
// name.

#ifndef BD_TECHNIQUE_PARAMS_H
#define BD_TECHNIQUE_PARAMS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"

#define BD_PARAM_MAX       32
#define BD_PARAM_KEY_MAX   32
#define BD_PARAM_VALUE_MAX 48

// Unchecked text, as the client gave it. A repeated key: the last one wins.
struct bd_param_list {
    uint32_t count;
    struct {
        char key[BD_PARAM_KEY_MAX];
        char value[BD_PARAM_VALUE_MAX];
    } pairs[BD_PARAM_MAX];
};

// Splits "KEY=VALUE" and appends it.
BD_MUST_CHECK
enum bd_err bd_param_list_add(struct bd_param_list *list, const char *key_equals_value,
                              struct bd_fault *fault);

enum bd_param {
    BD_PARAM_BRDF,        // full | lambert: without specular lobe and metals
    BD_PARAM_SHADOW_SIZE, // texels of one face's side
    BD_PARAM_VPLS,        // light samples per light source: k^2, or 6 k^2 over six faces
    BD_PARAM_VPL_BUDGET,  // of all lights: beyond it they are split by flux; 0 = four times `vpls`,
                          // not counting what clusters are split into
    BD_PARAM_RSM_SIZE,    // texels of one face's side
    BD_PARAM_VPL_KERNEL,  // patch | disk | point (pass/vpl_grid.h)
    BD_PARAM_NEAR_FIELD,  // radii (or half lengths) of a VPL's patch below which `patch` is exact
    BD_PARAM_PAPER_MODE,  // 1: the papers' printed formulas, and blocks unless others are given
    BD_PARAM_SPLAT_SHARE, // fragments of all splats, as a part of pixels x VPLs
    // Where one evaluation stands for a block of pixels (pass/discontinuity.h).
    BD_PARAM_DEPTH_TEST,       // minmax | derivative | off | step
    BD_PARAM_DEPTH_THRESHOLD,  // or inf, the same as off
    BD_PARAM_NORMAL_TEST,      // minmax | chord | off
    BD_PARAM_NORMAL_THRESHOLD, // or inf, the same as off
    BD_PARAM_NEIGHBOURHOOD,    // plain | diagonal | adjacent
    BD_PARAM_COARSEST,         // blocks along the longer side of the coarsest level, at most
    BD_PARAM_FINEST,           // pixels along a side of the blocks that are not split, 1, 2, 4 or 8
    BD_PARAM_LIGHT_THRESHOLD,  // spread of light over a block, as a part of it, above which it is
                               // split (with surface_detail=direction), or inf
    BD_PARAM_SURFACE_DETAIL,   // off | direction | paper (pass/upsample.h)
    BD_PARAM_VISIT,            // list | mask (pass/gather_fragments.h)
    BD_PARAM_SUB_FRAMES,       // shared | own: light of an antialiased frame's sub-frames
    // Of glossy receivers: how far blocks are split for each VPL (pass/subsplats.h,
    // pass/glossy_blocks.h).
    BD_PARAM_RADIANCE_TEST,      // relative | absolute
    BD_PARAM_RADIANCE_THRESHOLD, // a part of the radiance, or cd/m^2
    BD_PARAM_MATERIAL_THRESHOLD, // or inf
    BD_PARAM_SUBSPLAT_LIMIT,     // blocks of one list
    // Of a light's map: how far blocks of it are split.
    BD_PARAM_CLUSTER_LEVELS,           // how often a block may be split in four
    BD_PARAM_CLUSTER_DEPTH_THRESHOLD,  // as DEPTH_THRESHOLD, of the light's view
    BD_PARAM_CLUSTER_NORMAL_THRESHOLD, // as NORMAL_THRESHOLD
    BD_PARAM_TREE_CUT,                 // lightcuts | bound | level (pass/gather_tree.h)
    BD_PARAM_TAU,        // how far off a node may be that stands for its leaves, by TREE_CUT
    BD_PARAM_TREE_ROOTS, // of each light's tree, spread over the faces as VPLS
    // Of the reference: which part of the rendering equation (reference/reference.h), how often.
    BD_PARAM_MODEL_OF,            // a technique: presets bounces, indirect_visibility, lights,
                                  // senders, transmission and alpha to what its model says; what is
                                  // given beside it holds
    BD_PARAM_SPP,                 // samples a pixel, both halves together: even
    BD_PARAM_FIRST_SAMPLE,        // of those, the index of the first: even
    BD_PARAM_BOUNCES,             // of indirect light, or inf
    BD_PARAM_INDIRECT_VISIBILITY, // none | rays: what hides indirect light; of the reference, whose
                                  // paths are rays, none leaves it out. `off` and `on` say the same
    BD_PARAM_RAYS,                // VPLs of all that a receiver asks a ray for, or all of them
    BD_PARAM_LIGHTS,              // punctual, emissive, environment, joined by +; or all
    BD_PARAM_FILTER,              // point | box
    BD_PARAM_ALPHA,               // mask | coverage
    BD_PARAM_CLAMP,               // bound on cos cos / r^2 between surfaces, 1/m^2, or inf
    BD_PARAM_SENDERS,             // full | lambert
    BD_PARAM_TRANSMISSION,        // on | off
    BD_PARAM_LIGHT_VERTICES,      // on | off
    BD_PARAM_NOISE_FILTER,        // off | on (image/light_filter.h)
    BD_PARAM_LIGHT_RAYS,          // of a pixel to emissive surfaces and the sky, even; 0: those
                                  // light nothing
    BD_PARAM_LAMPS,               // auto | maps | rays: what hides direct light of punctual lights;
                                  // auto is rays where they are many (frame/plan.h)
    BD_PARAM_INDIRECT_LIGHTS,     // as LIGHTS: those whose light is sent on by surfaces
    BD_PARAM_INDIRECT_BOUNCES,    // how often light is sent on by surfaces, at most
    BD_PARAM_EXECUTOR,            // auto | device | native: who does arithmetic; auto is native on
                                  // a software device alone
    BD_PARAM_DRAWING,             // auto | raster | rays: how what cameras and lights see is found;
                                  // auto is rays on a software device, where the frame has them
                                  // anyway and triangles outnumber the samples of a map or picture
    BD_PARAM_WALK_VPLS,           // that light what a final gather's rays meet, beside VPLS
    BD_PARAM_CACHE_CELLS,         // of places that they meet, at most
    BD_PARAM_FAR_RAYS,            // of a pixel, even
    BD_PARAM_LIGHT_BLOCKS,        // auto | 1 | 2 | 4: pixels along a side of blocks whose light is
                                  // gathered as one; auto by counts (frame/plan.h)
    BD_PARAM_COUNT,
};

// What hides indirect light. BD_VISIBILITY_NONE is false.
enum bd_visibility { BD_VISIBILITY_NONE, BD_VISIBILITY_RAYS };

// Who does the arithmetic of passes that have a loop for the processor (pass/native).
enum bd_executor { BD_EXECUTOR_AUTO, BD_EXECUTOR_DEVICE, BD_EXECUTOR_NATIVE };

// How what a camera or a light sees is found (pass/first_hits.h).
enum bd_drawing { BD_DRAWING_AUTO, BD_DRAWING_RASTER, BD_DRAWING_RAYS };

// What hides direct light of punctual lights, and finds where it first falls.
enum bd_lamps_by { BD_LAMPS_AUTO, BD_LAMPS_MAPS, BD_LAMPS_RAYS };

// Whether each sub-frame has its own indirect light, or the first one's.
enum bd_sub_frames { BD_SUB_FRAMES_SHARED, BD_SUB_FRAMES_OWN };

// Checked values. Those that a technique does not read stand at their defaults.
struct bd_params {
    uint32_t lambert; // brdf: 0 = full, 1 = lambert
    uint32_t shadow_size;
    uint32_t vpls;
    uint32_t vpl_budget;
    uint32_t rsm_size;
    uint32_t vpl_kernel; // enum bd_vpl_kernel
    double near_field;
    uint32_t paper_mode;
    double splat_share;
    uint32_t depth_test, normal_test, neighbourhood; // enums of pass/discontinuity.h
    double depth_threshold, normal_threshold;        // INFINITY = off
    uint32_t coarsest;
    uint32_t finest_level;   // finest: 2^level pixels
    double light_threshold;  // INFINITY = off
    uint32_t surface_detail; // enum bd_surface_detail
    uint32_t visit;          // enum bd_fragment_visit
    uint32_t sub_frames;     // enum bd_sub_frames
    uint32_t radiance_test;  // enum bd_radiance_test
    double radiance_threshold, material_threshold;
    uint32_t subsplat_limit;
    uint32_t cluster_levels;
    double cluster_depth_threshold, cluster_normal_threshold; // INFINITY = off
    uint32_t tree_cut;                                        // enum bd_tree_criterion
    double tau;
    uint32_t tree_roots;
    uint32_t model_of; // 0 = none, else 1 + the index of a technique
    uint32_t spp, first_sample;
    uint32_t bounces;             // UINT32_MAX = unlimited
    uint32_t indirect_visibility; // enum bd_visibility
    uint32_t rays;
    uint32_t lights;         // enum bd_lights
    uint32_t filter;         // 0 = point, 1 = box
    uint32_t alpha_coverage; // 0 = mask
    double clamp_per_m2;     // INFINITY = none
    uint32_t senders_lambert;
    uint32_t transmission;
    uint32_t light_vertices;
    uint32_t noise_filter;
    uint32_t light_rays;
    uint32_t lamps; // enum bd_lamps_by
    uint32_t indirect_bounces;
    uint32_t indirect_lights; // enum bd_lights
    uint32_t executor;        // enum bd_executor
    uint32_t drawing;         // enum bd_drawing
    uint32_t walk_vpls, cache_cells, far_rays;
    uint32_t light_blocks; // 0 = auto, else one more than the logarithm of their side
};

// What clients are told about a parameter.
struct bd_param_info {
    const char *key, *what;     // static
    double minimum, maximum;    // of a number
    bool whole;                 // a number without a fraction
    const char *const *choices; // of a word; static
    uint32_t choice_count;      // 0 = a number
    char standard[BD_PARAM_VALUE_MAX];
};
struct bd_technique;
void bd_param_describe(const struct bd_technique *technique, enum bd_param param,
                       struct bd_param_info *out);

// A technique's own default: of a choice, its place.
struct bd_param_default {
    enum bd_param param;
    double value;
};

// The bit of a technique's `params_read`.
#define BD_READS(param) (UINT64_C(1) << (param))

// Reads `list` against what the technique reads; what is not in it has its default.
BD_MUST_CHECK
enum bd_err bd_params_read(const struct bd_param_list *list, const struct bd_technique *technique,
                           struct bd_params *out, struct bd_fault *fault);

// Whether the technique reads every parameter of `list`, whatever its value.
bool bd_params_are_read(const struct bd_param_list *list, const struct bd_technique *technique);

// A hash of the values of some of them, bits of BD_READS.
uint64_t bd_params_hash(const struct bd_params *params, uint64_t which, uint64_t seed);

// Every parameter that the technique reads, as text, in the table's order.
void bd_params_write(const struct bd_params *params, const struct bd_technique *technique,
                     struct bd_param_list *out);

#endif
