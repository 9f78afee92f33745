// A light as the passes need it: its frame, its faces, its place in render space.
//
// A spot up to 60 degrees from its axis and a directional light have one face; a point light and
// a wider spot have six, in the order +x -x +y -y +z -z of the light's own frame, which is that of
// its node.

#ifndef BD_UPLOAD_LIGHT_SETUP_H
#define BD_UPLOAD_LIGHT_SETUP_H

#include <stdint.h>

#include "scene/model/render_space.h"
#include "scene/model/scene.h"
#include "shared/light.h"
#include "upload/viewpoint.h"

#define BD_LIGHT_FACES_MAX 6

struct bd_light_setup {
    const struct bd_light *light; // borrowed from the scene
    struct bd_placement placement;
    uint32_t face_count; // 1 or 6
    double half_width;   // tangent of a face's half angle; metres for directional
    double half_height;
    double depth_m;      // directional: length of the frame along its axis
    double flux_lm;      // directional: lux times the frame's area
};

struct bd_light_setup bd_light_setup_of(const struct bd_scene *scene, uint32_t placed_light);

// Of all faces of its map.
static inline uint64_t bd_light_setup_texels(const struct bd_light_setup *setup, uint32_t side_px)
{
    return (uint64_t)setup->face_count * side_px * side_px;
}

// The viewpoint of one face's map of `side_px` squared texels.
struct bd_viewpoint bd_light_setup_viewpoint(const struct bd_light_setup *setup, uint32_t face,
                                             uint32_t side_px);

// `side_px` is the side of the map that the shader reads, 0 if none.
struct bd_light_uniform bd_light_setup_uniform(const struct bd_light_setup *setup,
                                               const struct bd_render_space *space,
                                               uint32_t side_px);

// Solid angle that a spot's cone is worth: the integral of its attenuation, in closed form
// 2 pi ((1 - cos inner) + (cos inner - cos outer) / 3). 4 pi for a point light.
double bd_light_effective_solid_angle_sr(const struct bd_light *light);

#endif
