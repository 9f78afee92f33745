// One texel of a map, filtered as a GPU filters level 0: bilinear between texel centres, or the
// nearest texel where the sampler says so; wrapped per axis; sRGB decoded before filtering.
//
// Any thread; reads the snapshot only.

#ifndef BD_REFERENCE_TEXTURE_H
#define BD_REFERENCE_TEXTURE_H

#include <stdbool.h>
#include <stdint.h>

#include "scene/model/scene.h"

// RGBA at texture coordinates (u, v), v down from the first row. Alpha is never sRGB. A texture
// whose picture is missing is white; coordinates that are not finite count as 0.
void bd_texture_at(const struct bd_scene *scene, const struct bd_texture *texture, bool srgb,
                   float u, float v, float out[4]);

// Alpha alone, for alpha tests.
float bd_texture_alpha_at(const struct bd_scene *scene, const struct bd_texture *texture, float u,
                          float v);

#endif
