#include "upload/viewpoint.h"

#include <math.h>

struct bd_viewpoint bd_viewpoint_of(const struct bd_scene *scene, const struct bd_pose *pose,
                                    uint32_t placed_camera, uint32_t width_px, uint32_t height_px)
{
    const struct bd_framing framing = bd_framing_of(scene, pose, placed_camera);
    return (struct bd_viewpoint){
        .position_m = framing.position_m,
        .axis_x = framing.axis_x,
        .axis_y = framing.axis_y,
        .axis_z = framing.axis_z,
        .orthographic = framing.orthographic,
        .half_width = framing.half_height * ((double)width_px / height_px),
        .half_height = framing.half_height,
        .near_m = framing.near_m,
        .far_m = fmin(framing.far_m, framing.near_m + 1e4 * scene->features.diagonal_m),
        .width_px = width_px,
        .height_px = height_px,
        .sample_x_px = 0.5,
        .sample_y_px = 0.5,
    };
}

struct bd_pixel_blocks bd_pixel_blocks_of(const struct bd_viewpoint *viewpoint, uint32_t side_px)
{
    struct bd_pixel_blocks blocks = {
        .side_px = side_px,
        .columns = (viewpoint->width_px + side_px - 1) / side_px,
        .rows = (viewpoint->height_px + side_px - 1) / side_px,
    };
    blocks.left_px = 0.5 * ((double)viewpoint->width_px - (double)blocks.columns * side_px);
    blocks.top_px = 0.5 * ((double)viewpoint->height_px - (double)blocks.rows * side_px);
    return blocks;
}

struct bd_viewpoint bd_viewpoint_of_blocks(const struct bd_viewpoint *viewpoint,
                                           const struct bd_pixel_blocks *blocks)
{
    struct bd_viewpoint out = *viewpoint;
    out.half_width *= (double)blocks->columns * blocks->side_px / viewpoint->width_px;
    out.half_height *= (double)blocks->rows * blocks->side_px / viewpoint->height_px;
    out.width_px = blocks->columns;
    out.height_px = blocks->rows;
    out.sample_x_px = out.sample_y_px = 0.5;
    return out;
}

static struct bd_vec4 vec4_from(bd_dvec3 v, double w)
{
    return (struct bd_vec4){(float)v.x, (float)v.y, (float)v.z, (float)w};
}

struct bd_view bd_viewpoint_uniform(const struct bd_viewpoint *viewpoint,
                                    const struct bd_render_space *space)
{
    double extent = viewpoint->orthographic ? space->render_per_m : 1.0;
    bd_dvec3 position = bd_render_from_world(space, viewpoint->position_m);
    return (struct bd_view){
        .position = vec4_from(position, viewpoint->orthographic ? 1 : 0),
        .axis_x = vec4_from(viewpoint->axis_x, viewpoint->half_width * extent),
        .axis_y = vec4_from(viewpoint->axis_y, viewpoint->half_height * extent),
        .axis_z = vec4_from(viewpoint->axis_z, viewpoint->near_m * space->render_per_m),
        .sample_px = {(float)viewpoint->sample_x_px, (float)viewpoint->sample_y_px,
                      (float)(viewpoint->far_m * space->render_per_m), 0},
        .size_px = {viewpoint->width_px, viewpoint->height_px, 0, 0},
    };
}
