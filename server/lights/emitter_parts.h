// Parts of emissive triangles, small where the map that they shine by is uneven, so that those that
// are drawn are bright. Private to lights/.
//
// A triangle is halved along its sides into four, and those again, all over the scene level by
// level: until no place of a part is three times as bright as its mean, or it is as small as a
// texel, or there is no more room. Parts that are black all over are left out.
//
// Thread: any.

#ifndef BD_LIGHTS_EMITTER_PARTS_H
#define BD_LIGHTS_EMITTER_PARTS_H

#include "lights/area_lights.h"

// Splits whole triangles, by rising number, into up to `room` parts, sorted by triangle and path
// (area_lights.h), where `lights` has room for them. `pause` as there.
BD_MUST_CHECK
enum bd_err bd_emitter_parts_split(struct bd_area_lights *lights, uint32_t room,
                                   enum bd_err (*pause)(void *user), void *user);

// About the mean of its brightest channel, cd/m^2; above 0 where the map is not black all over.
float bd_emitter_part_brightness(const struct bd_area_lights *lights,
                                 const struct bd_area_light *part);

// The path of the smallest part that a point of a triangle could lie in, at barycentrics of its
// second and third corner.
uint32_t bd_emitter_path_of(float u, float v);

#endif
