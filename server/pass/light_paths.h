// Light that surfaces send on and no punctual light's map holds, as VPLs: where that of emissive
// surfaces, the sky and punctual lights without maps first falls (the *first* set of light paths),
// and where any light falls after further reflections (the *walk* set, pass/light_walk.h). One
// description for all techniques, beside the maps of punctual lights. For a final gather
// (pass/far.h) the two sets stand apart, and first light of punctual lights and emitters comes as
// photons (pass/first_vpls.h).
//
// Points are spread over all surfaces by area (lights/surface_points.h), each is lit by a few rays
// as pixels are (pass/area_samples.h) and by what walks, and those that are lit are divided into
// patches (pass/light_patches.h).
//
// Punctual lights' light comes as photons: a spot may light less than what lies between two points,
// and all of it falls somewhere.
//
// Why from the surfaces and not from the lights: a sky's light that comes in by a window is found
// by every point that the window sees, and of paths from the sky few would come in; and the area
// that a point stands for is known, where a photon's would have to be estimated. What lights a very
// small part of all surfaces alone (a sun through a keyhole) is seen by few points.
//
// A function of the snapshot and these numbers: not of a camera, and of a seed for a final gather
// alone.
//
// Cost: 16 points a VPL, at least 16,384 and at most 131,072 in all, four rays a point: 20 to 60 ms
// of two cores for a thousand VPLs; 270 bytes a point while it runs. What walks takes as long
// again, up to twice in scenes of many small surfaces.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_LIGHT_PATHS_H
#define BD_PASS_LIGHT_PATHS_H

#include "lights/area_lights.h"
#include "lights/irradiance_points.h"
#include "lights/photon_map.h"
#include "lights/surface_points.h"
#include "pass/visibility.h"
#include "pass/vpl_grid.h"
#include "pass/vpl_tree.h"
#include "shared/light.h"
#include "upload/gpu_scene.h"

#define BD_LIGHT_PATHS_MAX 65536u
// Of punctual lights without maps: four points for each, of which there are 65,536 at most. More
// are no nearer.
#define BD_LIGHT_PATHS_OF_PUNCTUALS_MAX 16384u

struct bd_light_paths_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_scene *snapshot;
    const struct bd_area_lights *lights;      // NULL: none
    const struct bd_light_uniform *punctuals; // for `reflections` and `punctuals_fall`
    uint32_t punctual_count;
    bool punctuals_fall;  // no maps hold where their light first falls
    uint32_t reflections; // of the walk, as in pass/light_walk.h; 0: none
    struct bd_visibility_inputs visibility;
    uint32_t count; // of VPLs, at most BD_LIGHT_PATHS_MAX; 0: none
    // For a final gather: VPLs of what walks, at least 1. Then `count` are of where the sky's light
    // first falls, and others are photons. 0: none is made.
    uint32_t walk_vpls, punctual_vpls, emitter_vpls;
    // Of a final gather: whether there is a clamped list, and where that is (pass/vpl_order.h).
    bool clamped;
    float clamp;
    uint64_t seed; // of a final gather
    enum bd_vpl_kernel kernel;
    double near_field;   // as in pass/vpl_grid.h
    enum bd_sends sends; // what surfaces do
    bool glass;          // light goes through it
    uint32_t photons;    // that lamps send there; 0: none
    uint32_t root_side;  // of a tree over them, `count` a square of a power of two; 0: none
};

struct bd_light_paths {
    struct bd_vpl_list *vpls; // where fewer points are lit than VPLs, some send nothing; or NULL
    struct bd_vpl_tree *tree; // or NULL
    // For a final gather, or NULL: VPLs of where light first falls, and those with what walks, both
    // in order and soft (pass/vpl_order.h); the latter clamped, or NULL; and what comes to any
    // place further.
    struct bd_vpl_list *first, *all, *clamped;
    struct bd_irradiance_points *further;
    struct bd_photon_map *caustics; // where lamps' light lies behind glass; NULL: not asked for
    // And where that, sent on by surfaces, lies behind glass again; NULL: not asked for, or dim.
    struct bd_photon_map *caustics_again;
};

BD_MUST_CHECK
enum bd_err bd_light_paths_run(const struct bd_pass_context *context,
                               const struct bd_light_paths_inputs *inputs,
                               struct bd_light_paths **out, struct bd_err_detail *detail);
void bd_light_paths_destroy(struct bd_gpu *gpu, struct bd_light_paths **paths);
uint64_t bd_light_paths_bytes(const struct bd_light_paths *paths);

#endif
