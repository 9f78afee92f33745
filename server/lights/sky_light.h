// How the sky of bd_area_lights is made. Private to lights/.

#ifndef BD_LIGHTS_SKY_LIGHT_H
#define BD_LIGHTS_SKY_LIGHT_H

#include "lights/area_lights.h"

BD_MUST_CHECK
enum bd_err bd_sky_light_init(struct bd_sky_light *sky, const struct bd_environment *environment,
                              enum bd_err (*pause)(void *user), void *user,
                              struct bd_err_detail *detail);
void bd_sky_light_finish(struct bd_sky_light *sky);

// The first place whose value is above `number`, or the last one that rises above its neighbour.
uint32_t bd_cumulated_at(const float *cumulated, uint32_t count, float number);

#endif
