// Parameters of techniques: KEY=VALUE text in, checked numbers out, and back into a report.
//
// One table (params.c) holds every parameter that any technique takes, with range and default; a
// technique names the ones it reads, and those whose default is another with it. A key that no
// technique knows, one that this technique does not read, and a value out of range are refused by
// name.

#ifndef BD_TECHNIQUE_PARAMS_H
#define BD_TECHNIQUE_PARAMS_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"

#define BD_PARAM_MAX       64 // that a request may set, and that a technique may read
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
                              struct bd_err_detail *detail);

// What each does, its range and its words: its row in params.c. Here what clients are not told.
enum bd_param {
    BD_PARAM_BRDF,
    BD_PARAM_SHADOW_SIZE,
    BD_PARAM_VPLS,       // of a punctual light's map k^2, or 6 k^2 over six faces
    BD_PARAM_VPL_BUDGET, // not counting what clusters are split into
    BD_PARAM_RSM_SIZE,
    BD_PARAM_VPL_KERNEL, // pass/vpl_grid.h
    BD_PARAM_NEAR_FIELD, // of a patch that is longer than wide, half lengths
    BD_PARAM_PAPER_MODE, // and blocks unless others are given
    BD_PARAM_SPLAT_SHARE,
    // Where one evaluation stands for a block of pixels (pass/discontinuity.h). Thresholds of inf
    // are the same as off.
    BD_PARAM_DEPTH_TEST,
    BD_PARAM_DEPTH_THRESHOLD,
    BD_PARAM_NORMAL_TEST,
    BD_PARAM_NORMAL_THRESHOLD,
    BD_PARAM_NEIGHBOURHOOD,
    BD_PARAM_COARSEST,
    BD_PARAM_FINEST,
    BD_PARAM_LIGHT_THRESHOLD,
    BD_PARAM_SURFACE_DETAIL, // pass/upsample.h
    BD_PARAM_VISIT,          // pass/gather_fragments.h
    BD_PARAM_SUB_FRAMES,
    // Of glossy receivers: how far blocks are split for each VPL (pass/subsplats.h,
    // pass/glossy_blocks.h).
    BD_PARAM_RADIANCE_TEST,
    BD_PARAM_RADIANCE_THRESHOLD,
    BD_PARAM_MATERIAL_THRESHOLD, // or inf
    BD_PARAM_SUBSPLAT_LIMIT,
    // Of a light's map: how far blocks of it are split.
    BD_PARAM_CLUSTER_LEVELS,
    BD_PARAM_CLUSTER_DEPTH_THRESHOLD,
    BD_PARAM_CLUSTER_NORMAL_THRESHOLD,
    BD_PARAM_TREE_CUT, // pass/gather_tree.h
    BD_PARAM_TAU,
    BD_PARAM_TREE_ROOTS, // spread over the faces as VPLS
    // Of the reference: which part of the rendering equation (reference/reference.h), how often.
    BD_PARAM_MODEL_OF, // what is given beside it holds
    BD_PARAM_SPP,
    BD_PARAM_FIRST_SAMPLE,
    BD_PARAM_BOUNCES,             // or inf
    BD_PARAM_INDIRECT_VISIBILITY, // of the reference, whose paths are rays, none leaves it out.
                                  // `off` and `on` say the same
    BD_PARAM_RAYS,                // or as many as there are
    BD_PARAM_LIGHTS,
    BD_PARAM_FILTER,
    BD_PARAM_ALPHA,
    BD_PARAM_CLAMP, // or inf
    BD_PARAM_SENDERS,
    BD_PARAM_TRANSMISSION,
    BD_PARAM_LIGHT_VERTICES,
    BD_PARAM_NOISE_FILTER, // image/light_filter.h
    BD_PARAM_LIGHT_RAYS,
    BD_PARAM_LAMPS, // auto: frame/plan.h
    BD_PARAM_INDIRECT_LIGHTS,
    BD_PARAM_INDIRECT_BOUNCES,
    BD_PARAM_EXECUTOR,
    BD_PARAM_DRAWING, // auto: rays where the frame has them anyway and triangles outnumber the
                      // samples of a map or picture
    BD_PARAM_WALK_VPLS,
    BD_PARAM_CACHE_CELLS,
    BD_PARAM_FAR_RAYS,
    BD_PARAM_LIGHT_BLOCKS, // auto: frame/plan.h
    // Of what a clamp takes off and the picture gives back (pass/residual.h).
    BD_PARAM_RESIDUAL,
    BD_PARAM_ITERATIONS,
    BD_PARAM_RESIDUAL_LEVELS,
    BD_PARAM_RESIDUAL_THRESHOLD,
    BD_PARAM_RESIDUAL_EDGE_THRESHOLD,
    // Of imperfect shadow maps (pass/imperfect_shadows.h).
    BD_PARAM_ISM_SIZE,
    BD_PARAM_ISM_POINTS,
    BD_PARAM_ISM_BIAS,
    BD_PARAM_ISM_HOLES,
    BD_PARAM_LAMP_RADIUS,
    // Of what lamps send through glass (pass/photon_density.h).
    BD_PARAM_CAUSTICS,
    BD_PARAM_PHOTONS,
    BD_PARAM_PHOTON_RADIUS,
    // Of what photons' rays are asked of (pass/env_maps.h).
    BD_PARAM_INTERSECTIONS,
    BD_PARAM_ENV_MAPS,
    BD_PARAM_ENV_MAP_SIZE,
    // Of points that are projected (pass/project_points.h).
    BD_PARAM_POINTS,
    BD_PARAM_CLUSTERS,
    BD_PARAM_EXPLORE,
    BD_PARAM_EXPLOIT,
    BD_PARAM_MICROBUFFER,
    BD_PARAM_PROJECTION,
    BD_PARAM_MAP_RAYS,
    BD_PARAM_COUNT,
};

// What hides indirect light. BD_VISIBILITY_NONE is false.
enum bd_visibility { BD_VISIBILITY_NONE, BD_VISIBILITY_RAYS, BD_VISIBILITY_ISM };

// Who does the arithmetic of passes that have a loop for the processor (pass/native).
enum bd_executor { BD_EXECUTOR_AUTO, BD_EXECUTOR_DEVICE, BD_EXECUTOR_NATIVE };

// How what a camera or a light sees is found (pass/first_hits.h).
enum bd_drawing { BD_DRAWING_AUTO, BD_DRAWING_RASTER, BD_DRAWING_RAYS };

// What hides direct light of punctual lights, and finds where it first falls.
enum bd_lamps_by { BD_LAMPS_AUTO, BD_LAMPS_MAPS, BD_LAMPS_RAYS };

// Whether each sub-frame has its own indirect light, or the first one's.
enum bd_sub_frames { BD_SUB_FRAMES_SHARED, BD_SUB_FRAMES_OWN };

// What rays are asked of.
enum bd_intersections { BD_INTERSECTIONS_RAYS, BD_INTERSECTIONS_IMAGES };

// Who gives back what a clamp takes off.
enum bd_residual { BD_RESIDUAL_SCREEN, BD_RESIDUAL_RAYS, BD_RESIDUAL_BOTH };

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
    double clamp_per_m2;     // INFINITY = none; of virtual lights 0 = by how far they are apart
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
    uint32_t residual;     // enum bd_residual
    uint32_t iterations, residual_levels;
    double residual_threshold, residual_edge_threshold; // sr
    uint32_t ism_size, ism_points;
    double ism_bias;
    uint32_t ism_holes; // 0 = open, 1 = filled
    double lamp_radius_m;
    uint32_t caustics; // 0 = off, 1 = auto: where there is glass
    uint32_t photons;
    double photon_radius_m; // 0 = by their density
    uint32_t intersections; // enum bd_intersections
    uint32_t env_maps, env_map_size;
    uint32_t points, clusters, explore, exploit, microbuffer;
    uint32_t projection; // enum bd_projection
    uint32_t map_rays;
};

// Of what a clamp takes off, of techniques that read `residual`: whether the picture gives it back,
// and whether short rays bring it. `goes_on`: light does at glass and mirrors, of which rays bring
// more than the picture shows: with both it is all theirs.
static inline bool bd_params_bring_back(const struct bd_params *params)
{
    return params->residual != BD_RESIDUAL_SCREEN && params->clamp_per_m2 < INFINITY;
}

static inline bool bd_params_give_back(const struct bd_params *params, bool goes_on)
{
    return params->residual != BD_RESIDUAL_RAYS && params->iterations > 0 &&
           params->clamp_per_m2 < INFINITY && !(goes_on && bd_params_bring_back(params));
}

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

// A set of parameters, a bit of each: BD_READS(...) | BD_READS(...).
__extension__ typedef unsigned __int128 bd_param_set;
#define BD_READS(param) ((bd_param_set)1 << (param))
_Static_assert(BD_PARAM_COUNT <= 128, "each has a bit");

// Reads `list` against what the technique reads; what is not in it has its default.
BD_MUST_CHECK
enum bd_err bd_params_read(const struct bd_param_list *list, const struct bd_technique *technique,
                           struct bd_params *out, struct bd_err_detail *detail);

// Whether the technique reads every parameter of `list`, whatever its value.
bool bd_params_are_read(const struct bd_param_list *list, const struct bd_technique *technique);

// A hash of the values of some of them.
uint64_t bd_params_hash(const struct bd_params *params, bd_param_set which, uint64_t seed);

// Every parameter that the technique reads, as text, in the table's order.
void bd_params_write(const struct bd_params *params, const struct bd_technique *technique,
                     struct bd_param_list *out);

#endif
