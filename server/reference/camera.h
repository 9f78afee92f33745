// Rays of the camera, as the raster techniques frame the picture: the vertical angle holds whatever
// the picture's aspect; surfaces nearer than the near plane are absent; the far plane cuts
// orthographic views only.

#ifndef BD_REFERENCE_CAMERA_H
#define BD_REFERENCE_CAMERA_H

#include "reference/geometry.h"

struct bd_lens {
    bd_dvec3 position, axis_x, axis_y, axis_z; // reference space; looks along -z
    bool orthographic;
    double half_width, half_height; // orthographic: in reference units; else tangents
    double near, far;               // depths along -z in reference units
    double width_px, height_px;
};

struct bd_lens bd_lens_of(const struct bd_geometry *geometry,
                          const struct bd_reference_view *view);

// The ray through a point of the picture, from the top left corner, in pixels. Its direction is
// unit. `depth_per_distance`: depth along the view axis of a unit of the ray's length; `start` is
// the depth at which the ray begins.
void bd_lens_ray(const struct bd_lens *lens, const struct bd_geometry *geometry, double x_px,
                 double y_px, struct bd_ray *ray, double *start, double *depth_per_distance);

// How a place is seen, if it is in the picture and not cut off: in which pixel, over how many
// square pixels of an area across the ray, and how far along `to_eye` (unit) nothing may stand.
struct bd_seen {
    double x_px, y_px, px2_per_area;
    float to_eye[3], reach;
};
bool bd_lens_sees(const struct bd_lens *lens, const float position[3], struct bd_seen *out);

#endif
