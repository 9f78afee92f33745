#include "reference/camera.h"

#include <math.h>

#include "reference/vec3f.h"

struct bd_lens bd_lens_of(const struct bd_geometry *geometry, const struct bd_reference_view *view)
{
    const struct bd_framing framing = bd_framing_of(geometry->scene, &view->pose, view->camera);
    double units_per_m = geometry->units_per_m;
    double half_height = framing.half_height * (framing.orthographic ? units_per_m : 1);
    return (struct bd_lens){
        .position = bd_geometry_place(geometry, framing.position_m),
        .axis_x = framing.axis_x,
        .axis_y = framing.axis_y,
        .axis_z = framing.axis_z,
        .orthographic = framing.orthographic,
        .half_width = half_height * view->width_px / view->height_px,
        .half_height = half_height,
        .near = framing.near_m * units_per_m,
        .far = framing.orthographic ? framing.far_m * units_per_m : INFINITY,
        .width_px = view->width_px,
        .height_px = view->height_px,
    };
}

static bd_dvec3 across(const struct bd_lens *lens, double x_px, double y_px)
{
    double x = (2 * x_px / lens->width_px - 1) * lens->half_width;
    double y = (1 - 2 * y_px / lens->height_px) * lens->half_height;
    return bd_dvec3_add(bd_dvec3_scale(lens->axis_x, x), bd_dvec3_scale(lens->axis_y, y));
}

static void set_vector(float to[3], bd_dvec3 v)
{
    bd_vec3f_set(to, (float)v.x, (float)v.y, (float)v.z);
}

void bd_lens_ray(const struct bd_lens *lens, const struct bd_geometry *geometry, double x_px,
                 double y_px, struct bd_ray *ray, double *start, double *depth_per_distance)
{
    bd_dvec3 aside = across(lens, x_px, y_px), origin = lens->position;
    bd_dvec3 forward = bd_dvec3_scale(lens->axis_z, -1), direction = forward;
    if (lens->orthographic)
        origin = bd_dvec3_add(origin, aside);
    else
        direction = bd_dvec3_add(forward, aside);
    direction = bd_dvec3_scale(direction, 1 / bd_dvec3_length(direction));
    *depth_per_distance = bd_dvec3_dot(direction, forward);
    double near = lens->near / *depth_per_distance, far = lens->far / *depth_per_distance;
    // From where the ray may first meet anything: 32 bits need not tell a distant camera's place.
    double entry = -bd_dvec3_dot(origin, direction) - 1.01 * geometry->radius;
    double skipped = fmax(entry, near);
    set_vector(ray->origin, bd_dvec3_add(origin, bd_dvec3_scale(direction, skipped)));
    set_vector(ray->direction, direction);
    *start = skipped * *depth_per_distance;
    ray->near = 0;
    ray->far = (float)(far - skipped);
}

bool bd_lens_sees(const struct bd_lens *lens, const float position[3], struct bd_seen *out)
{
    const bd_dvec3 place = {position[0], position[1], position[2]};
    const bd_dvec3 to = bd_dvec3_sub(place, lens->position);
    const double depth = -bd_dvec3_dot(to, lens->axis_z), length = bd_dvec3_length(to);
    if (!(depth > lens->near) || !(depth < lens->far) || !(length > 0)) return false;
    const double scale = lens->orthographic ? 1 : 1 / depth;
    const double x = bd_dvec3_dot(to, lens->axis_x) * scale / lens->half_width;
    const double y = bd_dvec3_dot(to, lens->axis_y) * scale / lens->half_height;
    if (!(fabs(x) < 1) || !(fabs(y) < 1)) return false;
    const double px2 =
        lens->width_px * lens->height_px / (4 * lens->half_width * lens->half_height);
    const double cosine = lens->orthographic ? 1 : depth / length;
    out->x_px = (x + 1) / 2 * lens->width_px;
    out->y_px = (1 - y) / 2 * lens->height_px;
    // Of the plane at depth 1 a steradian has 1 / cosine^3, and at a distance 1 / length^2 of that.
    out->px2_per_area =
        lens->orthographic ? px2 : px2 / (cosine * cosine * cosine * length * length);
    set_vector(out->to_eye, lens->orthographic ? lens->axis_z : bd_dvec3_scale(to, -1 / length));
    out->reach = (float)((depth - lens->near) / cosine);
    return true;
}
