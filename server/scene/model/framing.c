#include "scene/model/framing.h"

#include <math.h>

static struct bd_framing of_camera(const struct bd_scene *scene, uint32_t placed_camera)
{
    const struct bd_placement *placed = &scene->placed_cameras[placed_camera];
    const struct bd_camera *camera = &scene->cameras[placed->object];
    return (struct bd_framing){
        .position_m = placed->position,
        .axis_x = placed->axis_x,
        .axis_y = placed->axis_y,
        .axis_z = placed->axis_z,
        .orthographic = camera->orthographic,
        .half_height = camera->orthographic ? camera->ymag : tan(0.5 * camera->yfov),
        .near_m = camera->near_m,
        .far_m = camera->far_m,
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

static struct bd_framing of_pose(const struct bd_scene *scene, const struct bd_pose *pose)
{
    const bd_dvec3 axis_z = bd_dvec3_normalize(bd_dvec3_sub(pose->eye_m, pose->target_m),
                                               (bd_dvec3){0, 0, 1});
    const bd_dvec3 axis_x =
        bd_dvec3_normalize(bd_dvec3_cross(pose->up, axis_z), (bd_dvec3){1, 0, 0});
    const double diagonal_m = scene->features.diagonal_m;
    return (struct bd_framing){
        .position_m = pose->eye_m,
        .axis_x = axis_x,
        .axis_y = bd_dvec3_cross(axis_z, axis_x),
        .axis_z = axis_z,
        .half_height = tan(0.5 * (pose->yfov > 0 ? pose->yfov : usual_yfov(scene))),
        .near_m = diagonal_m > 0 ? 1e-4 * diagonal_m : 1e-3,
        .far_m = INFINITY,
    };
}

struct bd_framing bd_framing_of(const struct bd_scene *scene, const struct bd_pose *pose,
                                uint32_t placed_camera)
{
    return pose->is_set ? of_pose(scene, pose) : of_camera(scene, placed_camera);
}
