// A viewpoint: where a raster pass looks from. A camera, or one face of a light.

#ifndef BD_UPLOAD_VIEWPOINT_H
#define BD_UPLOAD_VIEWPOINT_H

#include <stdbool.h>
#include <stdint.h>

#include "scene/model/framing.h"
#include "scene/model/render_space.h"
#include "scene/model/scene.h"
#include "shared/view.h"

struct bd_viewpoint {
    bd_dvec3 position_m;
    bd_dvec3 axis_x, axis_y, axis_z; // right, up, backwards; orthonormal
    bool orthographic;
    double half_width, half_height;  // tangents; metres if orthographic
    double near_m, far_m;            // far only if orthographic
    uint32_t width_px, height_px;
    double sample_x_px, sample_y_px; // within the pixel, .5 = centre
    uint32_t sub_frame;              // of the picture: bd_scene_least_alpha
};

// What a pose that is set sees, or else a placed camera, in a picture of that size. A camera's yfov
// (or ymag) is the vertical extent whatever the picture's aspect.
struct bd_viewpoint bd_viewpoint_of(const struct bd_scene *scene, const struct bd_pose *pose,
                                    uint32_t placed_camera, uint32_t width_px, uint32_t height_px);

// Blocks of pixels of a picture, from its middle on: those at the edges may reach beyond it.
struct bd_pixel_blocks {
    uint32_t side_px;       // of a block, in pixels; 1: none
    double left_px, top_px; // where the first begins, at most 0
    uint32_t columns, rows;
};
struct bd_pixel_blocks bd_pixel_blocks_of(const struct bd_viewpoint *viewpoint, uint32_t side_px);
// What looks the same way through a picture that has a pixel for each block.
struct bd_viewpoint bd_viewpoint_of_blocks(const struct bd_viewpoint *viewpoint,
                                           const struct bd_pixel_blocks *blocks);

struct bd_view bd_viewpoint_uniform(const struct bd_viewpoint *viewpoint,
                                    const struct bd_render_space *space);

#endif
