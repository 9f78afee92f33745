// Virtual point lights where light first falls: photons of equal flux, of punctual lights as many
// of each as its part of all their flux, of emissive surfaces likewise. All of the light lands
// somewhere, on however small a surface. Private to pass/.
//
// Against a grid over a punctual light's map: no block of it straddles an edge, whatever the
// punctual light sees from the side; and punctual lights may be many. What is off is where photons
// fall, which goes faster than by chance as they become many (Sobol 1967). For soft lists
// (pass/vpl_order.h): they have no areas.
//
// Plastic sends by its coat what comes to that (kernel/coat.h), the rest evenly.
//
// A function of the snapshot, these numbers and the seed. Cost: some 2 us of one core each.
//
// Keller 1997 (instant radiosity).
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_FIRST_VPLS_H
#define BD_PASS_FIRST_VPLS_H

#include "lights/area_lights.h"
#include "lights/surface_points.h"
#include "pass/pass.h"
#include "pass/visibility.h"
#include "shared/light.h"
#include "shared/types.h"
#include "shared/vpl.h"

// Of punctual lights, and of emitters: some 100 bytes each while they fly.
#define BD_FIRST_VPLS_MAX (UINT32_C(1) << 20)

struct bd_scene;

struct bd_first_vpls_inputs {
    const struct bd_scene *snapshot;
    const struct bd_visibility_inputs *visibility;
    const struct bd_light_uniform *punctuals; // render space, frame's unit
    uint32_t punctual_count;
    const struct bd_area_lights *emitters; // NULL: none
    float from_cd_m2;                      // to the frame's unit
    uint32_t of_punctuals, of_emitters;    // photons, at most BD_FIRST_VPLS_MAX of either
    uint64_t seed;
    enum bd_sends sends; // what surfaces do
    bool glass;          // photons go on through it (pass/onward.h)
    bool straight_alone; // and those are lost that others do not look along
};

// Of each photon a VPL, which sends nothing where that met nothing: so many of each array as there
// are photons of both.
BD_MUST_CHECK
enum bd_err bd_first_vpls_run(const struct bd_pass_context *context,
                              const struct bd_first_vpls_inputs *inputs,
                              struct bd_vec4 (*lights)[BD_VPL_VEC4S],
                              struct bd_vec4 (*quads)[BD_VPL_QUAD_VEC4S],
                              struct bd_err_detail *detail);

#endif
