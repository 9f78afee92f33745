// Light on its way from emissive surfaces: rays that carry equal shares of the flux of all of them,
// each of a part's own colour, spread evenly over what they send out. Private to pass/.
//
// Thread: any.

#ifndef BD_PASS_EMITTER_PHOTONS_H
#define BD_PASS_EMITTER_PHOTONS_H

#include "lights/area_lights.h"
#include "lights/sequence.h"
#include "rays/rays.h"

// Flux of all, of their brightest channels, in the frame's unit times render units squared. NULL:
// none.
double bd_emitters_flux(const struct bd_area_lights *lights, float from_cd_m2);

// So many photons, one after the other.
struct bd_emitter_photons {
    const struct bd_area_lights *lights;
    uint32_t count, next;
    double step; // of the flux of all, brightest channels
    uint32_t light;
    double passed; // flux of those before it
    float from_cd_m2;
    struct bd_sequence of_point, of_direction;
};

// `from_cd_m2`: to the frame's unit. Where nothing emits there are none.
struct bd_emitter_photons bd_emitter_photons_of(const struct bd_area_lights *lights, uint32_t count,
                                                float from_cd_m2, uint32_t seed, uint32_t purpose);

// False after the last. `flux` in the frame's unit times render units squared; `normal` of the side
// that it leaves.
bool bd_emitter_photons_next(struct bd_emitter_photons *photons, struct bd_ray *ray, f3 *flux,
                             f3 *normal);

#endif
