// The one shape that every GI technique has.
//
// A technique declares what it is (its model of light transport), which inputs the frame must
// build for it, and which parameters it reads; then it turns those inputs into indirect light. It
// never sees a socket, a file, the scene store or a sibling technique. The frame builds the inputs
// that it names and nothing else.
//
// Thread: render thread, context current.

#ifndef BD_TECHNIQUE_TECHNIQUE_H
#define BD_TECHNIQUE_TECHNIQUE_H

#include <stdbool.h>
#include <stdint.h>

#include "pass/gather_fragments.h"
#include "technique/params.h"

enum bd_frame_input {
    BD_INPUT_VPL_GRID = 1u << 0,  // a list of VPLs for each light, from its reflective shadow map
    BD_INPUT_FRAGMENTS = 1u << 1, // the picture's blocks that are lit as a whole
    BD_INPUT_VPL_CLUSTERS = 1u << 2, // instead of the grid: VPLs from blocks of several sizes
    BD_INPUT_VPL_TREE = 1u << 3, // beside the grid, whose side is a power of two: a tree over it
    BD_INPUT_FINAL_GATHER = 1u << 4, // light paths in two sets (pass/light_paths.h)
    BD_INPUT_SCREEN = 1u << 5,       // what falls on surfaces that are seen, by direct light
    BD_INPUT_PHOTONS = 1u << 6,      // photons where they landed (pass/photons.h)
    BD_INPUT_POINTS = 1u << 7,       // points with their light (pass/lit_points.h)
};

// Parameters that the frame reads for those inputs, G-buffer and direct light included.
#define BD_READS_LIGHT_PATHS BD_READS(BD_PARAM_INDIRECT_BOUNCES)
#define BD_READS_CAUSTICS    (BD_READS(BD_PARAM_CAUSTICS) | BD_READS(BD_PARAM_PHOTONS))
#define BD_READS_VISIBILITY                                                                        \
    (BD_READS(BD_PARAM_INDIRECT_VISIBILITY) | BD_READS(BD_PARAM_RAYS) | BD_READS(BD_PARAM_ALPHA) | \
     BD_READS(BD_PARAM_NOISE_FILTER) | BD_READS(BD_PARAM_ISM_SIZE) |                               \
     BD_READS(BD_PARAM_ISM_POINTS) | BD_READS(BD_PARAM_ISM_BIAS) | BD_READS(BD_PARAM_ISM_HOLES))
// Its default, where rays may hide indirect light (the reference's is another).
// clang-format off
#define BD_DEFAULT_VISIBILITY                                                                      \
    {BD_PARAM_INDIRECT_VISIBILITY, BD_VISIBILITY_NONE}
// clang-format on
// Of direct light; what is of area lights, and punctual lights by rays, is left out by
// light_rays=0.
#define BD_READS_DIRECT                                                                            \
    (BD_READS(BD_PARAM_BRDF) | BD_READS(BD_PARAM_SHADOW_SIZE) | BD_READS(BD_PARAM_LIGHT_RAYS) |    \
     BD_READS(BD_PARAM_LAMPS) | BD_READS(BD_PARAM_NOISE_FILTER) | BD_READS(BD_PARAM_EXECUTOR) |    \
     BD_READS(BD_PARAM_DRAWING))
#define BD_READS_VPL_GRID                                                                          \
    (BD_READS_DIRECT | BD_READS(BD_PARAM_VPLS) | BD_READS(BD_PARAM_VPL_BUDGET) |                   \
     BD_READS(BD_PARAM_RSM_SIZE) | BD_READS(BD_PARAM_VPL_KERNEL) | BD_READS(BD_PARAM_NEAR_FIELD) | \
     BD_READS(BD_PARAM_PAPER_MODE))
#define BD_READS_FRAGMENTS                                                                         \
    (BD_READS(BD_PARAM_DEPTH_TEST) | BD_READS(BD_PARAM_DEPTH_THRESHOLD) |                          \
     BD_READS(BD_PARAM_NORMAL_TEST) | BD_READS(BD_PARAM_NORMAL_THRESHOLD) |                        \
     BD_READS(BD_PARAM_NEIGHBOURHOOD) | BD_READS(BD_PARAM_COARSEST) | BD_READS(BD_PARAM_FINEST) |  \
     BD_READS(BD_PARAM_SURFACE_DETAIL))
#define BD_READS_SUBSPLATS                                                                         \
    (BD_READS(BD_PARAM_RADIANCE_TEST) | BD_READS(BD_PARAM_RADIANCE_THRESHOLD) |                    \
     BD_READS(BD_PARAM_MATERIAL_THRESHOLD) | BD_READS(BD_PARAM_SUBSPLAT_LIMIT))

// Kinds of light that can light surfaces.
enum bd_lights {
    BD_LIGHTS_PUNCTUAL = 1u << 0,
    BD_LIGHTS_EMISSIVE = 1u << 1,
    BD_LIGHTS_ENVIRONMENT = 1u << 2,
    BD_LIGHTS_ALL = 7,
};

#define BD_MODEL_BOUNCES_UNLIMITED UINT32_MAX

// A technique's light transport: what is left out of it by design is its error against the whole
// rendering equation that no parameter removes. The same words describe the reference's integrand
// for its model limit (`bounce reference --model-of NAME`); oracles that need more than a model has
// do not apply to it.
struct bd_model {
    uint32_t indirect_bounces;
    bool indirect_visibility; // occlusion between the surface that sends indirect light and the one
                              // that receives it
    uint32_t lights;          // enum bd_lights: those that light surfaces
    uint32_t indirect_lights; // those of them whose light surfaces send on
    bool glossy_receivers;    // indirect light is reflected by the whole BRDF towards the eye
    bool glossy_senders;      // and by the whole BRDF on its way there
    bool transmission;
    bool coverage; // BLEND lets light through instead of being a mask
};

// Largest relative error of a layer against a closed form that holds in the technique's own model
// (the harness derives from the model which closed forms those are).
struct bd_tolerance {
    double direct, indirect;
    // "KEY=VALUE KEY=VALUE": what must be set for it, where the defaults leave light out by design.
    // NULL: at default parameters.
    const char *settings;
};

struct bd_area_direct;
struct bd_direct;
struct bd_discontinuity;
struct bd_first_light;
struct bd_irradiance_cells;
struct bd_fragments;
struct bd_light_paths;
struct bd_lit_points;
struct bd_photons;
struct bd_scene;
struct bd_surfaces;
struct bd_vpl_tree;

// What stages of a frame made of what the camera sees (frame/stage_rows.h), each by its stage's
// name. The frame's memo owns it. A technique has no `direct`, `area_light`, `indirect` and
// `glass`.
struct bd_made {
    struct bd_gbuffer *gbuffer;
    struct bd_direct *direct;
    struct bd_area_direct *area_light;
    struct bd_discontinuity *discontinuity; // with the next two: BD_INPUT_FRAGMENTS
    struct bd_fragments *fragments;
    struct bd_surfaces *surfaces;
    struct bd_indirect *indirect;
    struct bd_indirect *glass; // what glass shows, where the technique has no rays for it
};

struct bd_technique_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    struct bd_made made;
    const struct bd_params *params;
    const struct bd_vpl_list *const *vpl_lists; // BD_INPUT_VPL_GRID or _CLUSTERS: one a light,
                                                // and light paths' (pass/light_paths.h)
    const struct bd_vpl_tree *const *vpl_trees; // BD_INPUT_VPL_TREE; one a list
    uint32_t list_count;
    const struct bd_vpl_list *vpls_in_order;  // of all lists, where some are chosen; else NULL
    const struct bd_light_paths *light_paths; // BD_INPUT_FINAL_GATHER
    const struct bd_photons *photons;         // BD_INPUT_PHOTONS
    const struct bd_lit_points *points;       // BD_INPUT_POINTS
    const struct bd_first_light *first_light; // of either
    const struct bd_irradiance_cells *cells;  // of sub-frames that share: the first one's
    const struct bd_scene *snapshot;
    const struct bd_occluders *occluders; // indirect_visibility=rays, a final gather's, photons'
    const struct bd_imperfect_view *maps; // indirect_visibility=ism
    const struct bd_env_view *images;     // intersections=images, for all of its rays
    const struct bd_surface_hits *panes;  // where light goes straight through; NULL: nowhere
    enum bd_straight straight;
    bool veils;                           // and what blends
    struct bd_pool *pool;                 // for either
    bool chosen;                          // there are fewer rays than VPLs
    bool filtered;                        // what they leave noisy
    float variance_part; // of its noise's, that filters go by (image/light_filter.h)
    uint64_t seed;                        // of what is chosen
    uint64_t seed_of_sub_frame;           // of what each draws by numbers of its own
    bool alone; // the frame's only sub-frame: no other one's noise is added to its own
    bool glossy_receivers, rough_receivers;
    bool glass;       // some surface lets light through, or mirrors: followed light goes on there
    bool normal_maps; // some surface has one: normals change from pixel to pixel
};

// Fragments that are to be lit.
struct bd_unlit {
    const struct bd_fragments *fragments;
    bool spread;                    // how far off interpolated light may be is asked for, too
    struct bd_multires_light *into; // NULL, or earlier light that these fragments are added to
};

// Brackets its passes itself.
typedef enum bd_err bd_light_fragments_fn(const struct bd_pass_context *context,
                                          const struct bd_technique_inputs *inputs,
                                          const struct bd_unlit *unlit,
                                          struct bd_multires_light **out,
                                          struct bd_err_detail *detail);

// With fewer far rays lobes of rough dielectrics have none of their own: two rays of those take as
// long as the far rays themselves, and their noise is as large as what they would bring beyond even
// light.
#define BD_FAR_RAYS_FOR_ROUGH 8u

// What must hold for a pass to run: all of its bits.
enum bd_when {
    BD_WHEN_GLOSSY = 1u << 0,   // receivers have a specular lobe worth its price
    BD_WHEN_ASKED = 1u << 1,    // indirect_visibility is not none
    BD_WHEN_CHOSEN = 1u << 2,   // and fewer rays than VPLs
    BD_WHEN_FILTERED = 1u << 3, // and noise_filter=on
    BD_WHEN_FIRST = 1u << 4,    // sub-frames that share light take over what it made; always
    BD_WHEN_ROUGH = 1u << 5,    // receivers have a specular lobe that is not
    BD_WHEN_SCREEN = 1u << 6,   // the picture gives back what a clamp takes off
    BD_WHEN_SHORT = 1u << 7,    // short rays bring that back
    BD_WHEN_CAUSTICS = 1u << 8, // lamps send light through glass
};

// A pass of the technique's own, which it brackets with bd_gpu_pass_begin and _end.
struct bd_technique_pass {
    const char *name; // of protocol/bounced.proto, ReportPass
    uint32_t when;    // bits of enum bd_when
};

struct bd_technique {
    const char *name; // on the wire, in logs, in file names
    const char *summary;
    struct bd_model model;
    uint32_t inputs; // BD_INPUT_*
    // What its indirect light runs after the inputs are made, in order, ended by one without a
    // name. NULL if it has no indirect light. Where none is for glossy receivers, the pass that
    // lights (bd_technique_light_pass) lights those too.
    const struct bd_technique_pass *passes;
    bd_param_set params_read;
    const struct bd_param_default *defaults; // where they differ from the table's
    uint32_t default_count;
    struct bd_tolerance tolerance;
    // Codes of the hazards that concern it beside those that concern all (algorithms.md C): letters
    // of "TNSIP", "" for none.
    const char *hazard_codes;
    // Settings from the cheapest to the best, "KEY=VALUE KEY=VALUE" each, ended by NULL: the rungs
    // of error against run time, and what `--target-error` climbs.
    const char *const *ladder;
    uint32_t
        view_rungs; // that a view at rest climbs at once, where one alone is not worth it; 0: one
    // There for others to be compared with: tests of all techniques at once judge it on less.
    bool for_comparison;
    bool is_sampled;   // decided by chance at its defaults: exact in the mean, with noise
    bool is_reference; // path-traced by reference/, not rendered on the device
    // Indirect light of one frame; NULL if the technique has none. Not called without lights.
    enum bd_err (*indirect)(const struct bd_pass_context *context,
                            const struct bd_technique_inputs *inputs, struct bd_indirect **out,
                            struct bd_err_detail *detail);
    // How it lights pixels of a list, each by itself: with it the sub-frames of an antialiased
    // frame share the first one's light (technique/sub_frame_light.h). NULL: each has its own.
    bd_light_fragments_fn *light_pixels;
    // What the whole BRDF reflects beyond that, added as `glossy` of `indirect`. NULL: `indirect`
    // does both at once, and sub-frames share nothing where receivers are glossy.
    enum bd_err (*light_glossy)(const struct bd_pass_context *context,
                                const struct bd_technique_inputs *inputs,
                                struct bd_indirect *indirect, struct bd_err_detail *detail);
};

// The pass that lights, whatever holds: the first that always runs. The technique has one.
static inline const char *bd_technique_light_pass(const struct bd_technique *technique)
{
    const struct bd_technique_pass *pass = technique->passes;
    while (pass->when) pass++;
    return pass->name;
}

// Of rays that end where they hit something.
static inline struct bd_visibility_inputs
bd_technique_visibility(const struct bd_technique_inputs *inputs)
{
    return (struct bd_visibility_inputs){.occluders = inputs->occluders,
                                         .pool = inputs->pool,
                                         .images = inputs->images,
                                         .panes = inputs->panes,
                                         .straight = inputs->straight,
                                         .veils = inputs->veils,
                                         .alpha =
                                             (enum bd_rays_alpha)inputs->params->alpha_coverage};
}

// Of VPLs, whatever hides them.
static inline struct bd_visibility_inputs
bd_technique_vpl_visibility(const struct bd_technique_inputs *inputs)
{
    struct bd_visibility_inputs visibility = bd_technique_visibility(inputs);
    visibility.maps = inputs->maps;
    visibility.nothing_hides = inputs->params->indirect_visibility == BD_VISIBILITY_NONE;
    visibility.by_chance = inputs->straight == BD_STRAIGHT_ALL;
    return visibility;
}

// Whether anything is asked at all.
static inline bool bd_technique_asks(const struct bd_technique_inputs *inputs)
{
    return inputs->occluders || inputs->maps;
}

// For those that light every pixel from the lists.
static inline struct bd_gather_inputs
bd_technique_gather_inputs(const struct bd_technique_inputs *inputs)
{
    return (struct bd_gather_inputs){
        .scene = inputs->scene,
        .viewpoint = inputs->viewpoint,
        .gbuffer = inputs->made.gbuffer,
        .lists = inputs->vpl_lists,
        .list_count = inputs->list_count,
        .near_patches = inputs->params->vpl_kernel == BD_KERNEL_PATCH,
        .glossy = inputs->glossy_receivers,
    };
}

extern const struct bd_technique bd_technique_direct;
extern const struct bd_technique bd_technique_hisr;
extern const struct bd_technique bd_technique_isr;
extern const struct bd_technique bd_technique_many_light;
extern const struct bd_technique bd_technique_multires_gather;
extern const struct bd_technique bd_technique_multires_splat;
extern const struct bd_technique bd_technique_photon;
extern const struct bd_technique bd_technique_point_projection;
extern const struct bd_technique bd_technique_reference;
extern const struct bd_technique bd_technique_rsm;
extern const struct bd_technique bd_technique_rsm_splat;
extern const struct bd_technique bd_technique_ssbc;

// What a request that names no technique names.
#define BD_TECHNIQUE_AUTO "auto"
// What that is where nothing speaks for another.
extern const struct bd_technique *const bd_technique_default;

// "" and "auto".
bool bd_technique_is_auto(const char *name);
// The one of that name, otherwise as bd_technique_find; for "auto" what it prefers of those that
// read every parameter given.
const struct bd_technique *bd_technique_for(const char *name, const struct bd_param_list *given,
                                            struct bd_err_detail *detail);
// By name; NULL and an error that lists the names if there is none.
const struct bd_technique *bd_technique_find(const char *name, struct bd_err_detail *detail);
// All of them, in order; NULL past the last.
const struct bd_technique *bd_technique_at(uint32_t index);
// Their names, in order; static.
const char *const *bd_technique_names(uint32_t *count);

#endif
