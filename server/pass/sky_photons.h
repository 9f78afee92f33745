// Light on its way from the sky: rays through a disc that holds the scene, as many from each
// direction as it is bright. Private to pass/.
//
// Thread: any.

#ifndef BD_PASS_SKY_PHOTONS_H
#define BD_PASS_SKY_PHOTONS_H

#include "lights/area_lights.h"
#include "rays/rays.h"

struct bd_sky_photons {
    const struct bd_sky_light *sky;
    float radius; // of a sphere about the render origin that holds the scene
    float from_cd_m2;
};

// What comes in in all, of the brightest channel, in the frame's unit times render units squared:
// a mean of few looks.
double bd_sky_photons_flux(const struct bd_sky_photons *photons);

// The ray of a photon for numbers in [0, 1), and the flux of all if each carried as much.
struct bd_ray bd_sky_photons_ray(const struct bd_sky_photons *photons, const float way[2],
                                 const float place[2], f3 *flux);

#endif
