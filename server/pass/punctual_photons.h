// Light on its way from punctual lights: rays that carry equal shares of a light's flux, spread
// evenly over what it sends out; and what arrives at a place. Private to pass/.
//
// Thread: any.

#ifndef BD_PASS_PUNCTUAL_PHOTONS_H
#define BD_PASS_PUNCTUAL_PHOTONS_H

#include "kernel/math.h"
#include "rays/rays.h"
#include "shared/light.h"

// Flux in the frame's unit times render units squared, before the window of its range: of a
// directional light what goes through its frame, a rectangle that holds the scene.
f3 bd_punctual_flux(const struct bd_light_uniform *punctual);

// Irradiance at a place with that unit normal, where nothing stands between, in the frame's unit.
f3 bd_punctual_irradiance(const struct bd_light_uniform *punctual, f3 position, f3 normal);

// The ray of a photon for two numbers in [0, 1).
struct bd_ray bd_punctual_ray(const struct bd_light_uniform *punctual, const float number[2]);

#endif
