// Where light falls that surfaces have sent on once or more: the *walk* set of light paths, on the
// points of the first (pass/light_paths.h).
//
// Photons of equal flux start at points, as many from each as it sends on, and go as a diffuse
// surface sends light out; those nearest to where one arrives take what it brings
// (lights/point_tree.h) and send their part of that on in the next round: in each round as many as
// the flux that is left. A point sends as many as it expects, the part of one by its own lot
// (Russian roulette), in its own directions, so that it sends alike whatever happens elsewhere.
// Punctual lights' own light is brought to the points in the same way.
//
// Where none of those sees where it came from, the surface is so small that no point stands for it:
// the place itself becomes a point. Flux is conserved to rounding but for what leaves the scene and
// what unlit surfaces and rears absorb.
//
// A function of the snapshot and these numbers, and not of a camera.
//
// Cost: as many photons as points for the punctual lights, and for the first round: about 1 us each
// of one core.
//
// Arvo and Kirk 1990 (particle tracing, roulette); Jensen 1996 (nearest neighbours).
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_LIGHT_WALK_H
#define BD_PASS_LIGHT_WALK_H

#include "lights/area_lights.h"
#include "lights/surface_points.h"
#include "pass/pass.h"
#include "pass/visibility.h"
#include "shared/light.h"

struct bd_light_walk_inputs {
    const struct bd_scene *snapshot;
    struct bd_surface_points *points; // up to twice as many afterwards
    struct bd_visibility_inputs visibility;
    const struct bd_light_uniform *punctuals; // render space, frame's unit
    uint32_t punctual_count;
    const struct bd_area_lights *emitters; // whose light comes as punctual lights' does; NULL: none
    float from_cd_m2;                      // to the frame's unit
    uint32_t reflections; // that light takes at most on its way to a point; 0 to 63
    enum bd_sends sends;  // as in lights/surface_points.h
    bool glass;           // photons go on through it (pass/onward.h)
    bool caustics_are_first; // what comes straight from lights through it counts as if without
    uint32_t seed;        // of photons
};

// Irradiance of each point, by what it has come by.
struct bd_lit_points {
    f3 *others;  // straight from lights that send no photons
    f3 *behind;  // from the former through glass; NULL: nothing
    f3 *first;   // straight from those that do
    f3 *further; // from any, after reflections; through glass what is not the first
};

// `lit->others` and `behind` are the caller's, allocated; the result is of all points that there
// are then, and the caller's, too. Where as little as 1/8192 of the flux is left, it is left out.
BD_MUST_CHECK
enum bd_err bd_light_walk_run(const struct bd_pass_context *context,
                              const struct bd_light_walk_inputs *inputs, struct bd_lit_points *lit,
                              struct bd_err_detail *detail);

#endif
