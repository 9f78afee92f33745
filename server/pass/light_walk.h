// Where light falls that surfaces have sent on once or more: the *walk* set of light paths, on the
// points of the first (pass/light_paths.h).
//
// Photons of equal flux start at points, as many from each as it sends on, and go as a diffuse
// surface sends light out; those nearest to where one arrives take what it brings
// (lights/point_tree.h) and send their part of that on in the next round. Each round's photons are
// chosen anew, in even steps through the flux of all points: as many as the flux that is left
// (Russian roulette, stratified). Lamps' own light is brought to the points in the same way, and is
// told only where they have no maps that send it on.
//
// Where none of those sees where it came from, the surface is so small that no point stands for it:
// the place itself becomes a point. Flux is conserved to rounding but for what leaves the scene and
// what unlit surfaces and rears absorb.
//
// A function of the snapshot and these numbers: neither of a camera nor of a seed.
//
// Cost: as many photons as points for the lamps, and for the first round: about 1 us each of one
// core.
//
// Arvo and Kirk 1990 (particle tracing, roulette); Jensen 1996 (nearest neighbours).
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_LIGHT_WALK_H
#define BD_PASS_LIGHT_WALK_H

#include "lights/surface_points.h"
#include "pass/pass.h"
#include "pass/visibility.h"
#include "shared/light.h"

struct bd_light_walk_inputs {
    const struct bd_scene *snapshot;
    struct bd_surface_points *points; // up to twice as many afterwards
    struct bd_visibility_inputs visibility;
    const struct bd_light_uniform *lamps; // render space, frame's unit
    uint32_t lamp_count;
    bool lamps_fall;      // where their own light arrives is told, too
    uint32_t reflections; // that light takes at most on its way to a point; 0 to 63
    bool lambert;         // as in lights/surface_points.h
};

// `irradiance` of each point, allocated, the caller's: in, what other lights than the lamps bring;
// out, of the points that there are then, what arrives after that many reflections and fewer, and
// the former. Where as little as 1/8192 of the flux is left, it is left out.
BD_MUST_CHECK
enum bd_err bd_light_walk_run(const struct bd_pass_context *context,
                              const struct bd_light_walk_inputs *inputs, f3 **irradiance,
                              struct bd_fault *fault);

#endif
