// A punctual light as glTF defines it (KHR_lights_punctual), and the faces of its maps.
#ifndef BD_KERNEL_LIGHT_H
#define BD_KERNEL_LIGHT_H

#include "kernel/math.h"

// The recommended window of the extension: reaches 0 at the range.
KERNEL float window_of_range(float distance, float inverse_range)
{
    float x = distance * inverse_range;
    return f_min(f_max(1.0f - x * x * x * x, 0.0f), 1.0f);
}

// `per_cosine`: 1 / (cos(inner) - cos(outer)).
KERNEL float attenuation_of_cone(float cosine, float cos_outer, float per_cosine)
{
    float a = f_min(f_max((cosine - cos_outer) * per_cosine, 0.0f), 1.0f);
    return a * a;
}

// Irradiance at normal incidence of a point light or a spot, per intensity; `span` goes to it.
KERNEL float irradiance_at(f3 span, f3 direction, float cos_outer, float per_cosine,
                           float inverse_range)
{
    float distance_squared = f_max(f3_dot(span, span), 1e-30f);
    float distance = f_sqrt(distance_squared);
    float cosine = f3_dot(f3_scale(span, -1.0f / distance), direction);
    float cone = attenuation_of_cone(cosine, cos_outer, per_cosine);
    return cone * window_of_range(distance, inverse_range) / distance_squared;
}

// --- faces --------------------------------------------------------------------------------------

// In the order +x -x +y -y +z -z of the light's own frame. A light of one face looks along -z.
#define LIGHT_ONE_FACE 5u

// Of a light with six, that which sees a direction of its frame.
KERNEL uint face_towards(f3 d)
{
    f3 a = f3_abs(d);
    bool is_x = b_and(a.x >= a.y, a.x >= a.z), is_y = a.y >= a.z;
    float ahead = f_select(is_x, d.x, f_select(is_y, d.y, d.z));
    uint axis = u_select(is_x, 0u, u_select(is_y, 2u, 4u));
    return axis + u_select(ahead > 0.0f, 0u, 1u);
}

// A direction of the light's frame as a face sees it: to the right, up, and ahead.
KERNEL f3 seen_from_face(f3 d, uint face)
{
    bool along_x = face < 2u, along_z = face > 3u;
    float way = f_select((face & 1u) == 0u, 1.0f, -1.0f);
    float ahead = way * f_select(along_x, d.x, f_select(along_z, d.z, d.y));
    float right = f_select(along_x, d.z * way, f_select(along_z, -d.x * way, d.x));
    float up = f_select(b_or(along_x, along_z), d.y, d.z * way);
    return f3_of(right, up, ahead);
}

#endif
