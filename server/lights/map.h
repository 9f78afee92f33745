// Maps of materials at a point of a surface, bilinear at the finest level as devices filter.
// Private to lights/.

#ifndef BD_LIGHTS_MAP_H
#define BD_LIGHTS_MAP_H

#include "kernel/math.h"
#include "scene/model/scene.h"

// Colours are linear, sRGB texels decoded before they are mixed; 1 where there is no map.
struct bd_map_texel {
    f3 rgb;
    float alpha;
};
struct bd_map_texel bd_map_at(const struct bd_scene *scene, const struct bd_texture_ref *map,
                              const struct bd_primitive *primitive, const uint32_t index[3],
                              float u, float v);

// The same of a map of data, whose texels are linear as they are.
struct bd_map_texel bd_map_data_at(const struct bd_scene *scene, const struct bd_texture_ref *map,
                                   const struct bd_primitive *primitive, const uint32_t index[3],
                                   float u, float v);

// Of the colours that a map may show within a triangle of these barycentrics: the most and the mean
// of their brightest channel, told where few thousand texels tell it, and how many texels the
// triangle is long along the longer of the map's axes.
struct bd_map_range {
    bool is_told;
    float most, mean, side_texels;
};
struct bd_map_range bd_map_range(const struct bd_scene *scene, const struct bd_texture_ref *map,
                                 const struct bd_primitive *primitive, const uint32_t index[3],
                                 const float u[3], const float v[3]);

// Interpolates a stream of `size` numbers a vertex.
void bd_stream_at(const float *stream, uint32_t size, const uint32_t index[3], float u, float v,
                  float *out);

#endif
