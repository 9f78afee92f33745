#include "upload/viewpoint.h"

#include <math.h>

struct bd_viewpoint bd_viewpoint_of_camera(const struct bd_scene *scene, uint32_t placed_camera,
                                           uint32_t width_px, uint32_t height_px)
{
    const struct bd_placement *placed = &scene->placed_cameras[placed_camera];
    const struct bd_camera *camera = &scene->cameras[placed->object];
    double aspect = (double)width_px / height_px;
    double half_height = camera->orthographic ? camera->ymag : tan(0.5 * camera->yfov);
    double far_limit_m = camera->near_m + 1e4 * scene->features.diagonal_m;
    return (struct bd_viewpoint){
        .position_m = placed->position,
        .axis_x = placed->axis_x,
        .axis_y = placed->axis_y,
        .axis_z = placed->axis_z,
        .orthographic = camera->orthographic,
        .half_width = half_height * aspect,
        .half_height = half_height,
        .near_m = camera->near_m,
        .far_m = fmin(camera->far_m, far_limit_m),
        .width_px = width_px,
        .height_px = height_px,
        .sample_x_px = 0.5,
        .sample_y_px = 0.5,
    };
}

// Of the first camera, where that has one.
static double usual_yfov(const struct bd_scene *scene)
{
    const double sixty_degrees = 1.0471975511965976;
    if (scene->placed_camera_count == 0) return sixty_degrees;
    const struct bd_camera *camera = &scene->cameras[scene->placed_cameras[0].object];
    return camera->orthographic ? sixty_degrees : (double)camera->yfov;
}

struct bd_viewpoint bd_viewpoint_of_pose(const struct bd_scene *scene, const struct bd_pose *pose,
                                         uint32_t width_px, uint32_t height_px)
{
    const bd_dvec3 axis_z = bd_dvec3_normalize(bd_dvec3_sub(pose->eye_m, pose->target_m),
                                               (bd_dvec3){0, 0, 1});
    const bd_dvec3 axis_x =
        bd_dvec3_normalize(bd_dvec3_cross(pose->up, axis_z), (bd_dvec3){1, 0, 0});
    double half_height = tan(0.5 * (pose->yfov > 0 ? pose->yfov : usual_yfov(scene)));
    double near_m = scene->features.diagonal_m > 0 ? 1e-4 * scene->features.diagonal_m : 1e-3;
    return (struct bd_viewpoint){
        .position_m = pose->eye_m,
        .axis_x = axis_x,
        .axis_y = bd_dvec3_cross(axis_z, axis_x),
        .axis_z = axis_z,
        .half_width = half_height * width_px / height_px,
        .half_height = half_height,
        .near_m = near_m,
        .far_m = near_m + 1e4 * scene->features.diagonal_m,
        .width_px = width_px,
        .height_px = height_px,
        .sample_x_px = 0.5,
        .sample_y_px = 0.5,
    };
}

void bd_viewpoint_set_sub_frame(struct bd_viewpoint *viewpoint, uint32_t index, uint32_t count)
{
    // The R2 sequence (Roberts 2018): the plastic number's inverse powers, started at the centre.
    const double g1 = 0.7548776662466927, g2 = 0.5698402909980532;
    viewpoint->sample_x_px = count > 1 ? fmod(0.5 + index * g1, 1.0) : 0.5;
    viewpoint->sample_y_px = count > 1 ? fmod(0.5 + index * g2, 1.0) : 0.5;
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
