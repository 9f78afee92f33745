// Photons that lamps send to glass and mirrors, where they land behind: light that no segment to a
// lamp finds, and hardly a ray.
//
// Each goes from a lamp, chosen by what it may send there, to one of the spheres that hold what is
// either, and on from that (pass/onward.h); brushed metal on the way keeps photons, too, since
// light lands there as it goes on. Where spheres overlap a direction counts as often as it is aimed
// at. What misses the glass, and what never leaves it, is left out. The sky sends none: rays find
// it.
//
// From where it lands each is sent once more to those spheres, as a diffuse surface sends it on: a
// focus in front of glass shines through that, and rays from where it falls hardly find it.
//
// A function of the snapshot, its lights and these numbers, and not of a camera.
//
// Jensen 1996 (photons aimed at what is specular); algorithms.md A5.5.
// Cost: 1 to 3 us a photon and core.
//
// Private to pass/. Thread: render thread, and the pool's.

#ifndef BD_PASS_CAUSTIC_PHOTONS_H
#define BD_PASS_CAUSTIC_PHOTONS_H

#include "lights/area_lights.h"
#include "lights/photon_map.h"
#include "pass/pass.h"
#include "pass/visibility.h"
#include "shared/light.h"

struct bd_caustic_photons_inputs {
    const struct bd_scene *snapshot;
    const struct bd_visibility_inputs *visibility;
    const struct bd_light_uniform *punctuals; // render space, frame's unit
    uint32_t punctual_count;
    const struct bd_area_lights *emitters; // NULL: none
    float from_cd_m2;                      // to the frame's unit
    bool mirrors_alone;                    // brushed metal sends by itself (lights/point_lobes.h)
    enum bd_sends sends;                   // what surfaces do, of what goes on
    uint32_t count;                        // that are sent, 1 to BD_PHOTONS_MAX
    uint64_t seed;
};

// A map of those that land; and of those that landed before, were sent on, went through glass and
// landed again: NULL where they are too few to matter. `again` itself may be NULL.
BD_MUST_CHECK
enum bd_err bd_caustic_photons_run(const struct bd_pass_context *context,
                                   const struct bd_caustic_photons_inputs *inputs,
                                   struct bd_photon_map **out, struct bd_photon_map **again,
                                   struct bd_err_detail *detail);

#endif
