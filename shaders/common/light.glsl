// A punctual light as glTF defines it (KHR_lights_punctual).
#include "kernel/light.h"
#include "shared/bindings.h"
#include "shared/light.h"

layout(std140, binding = BD_UNIFORM_LIGHT) uniform light_block { bd_light_uniform light; };

float range_window(float distance) { return window_of_range(distance, light.inverse_range); }

// A light of one face is seen as the last of six.
uint face_in_frame(uint face) { return light.face_count == 1u ? LIGHT_ONE_FACE : face; }

// Unit direction of face `face`'s axes in render space; it looks along -z.
void light_face_axes(uint face, out vec3 x, out vec3 y, out vec3 z)
{
    mat3 frame = mat3(light.axis_x.xyz, light.axis_y.xyz, light.axis_z.xyz);
    vec3 of_x = seen_from_face(vec3(1.0, 0.0, 0.0), face_in_frame(face));
    vec3 of_y = seen_from_face(vec3(0.0, 1.0, 0.0), face_in_frame(face));
    vec3 of_z = seen_from_face(vec3(0.0, 0.0, 1.0), face_in_frame(face));
    x = frame * vec3(of_x.x, of_y.x, of_z.x);
    y = frame * vec3(of_x.y, of_y.y, of_z.y);
    z = frame * -vec3(of_x.z, of_y.z, of_z.z);
}

// A direction given relative to the light, in its own frame.
vec3 in_light_frame(vec3 from_light)
{
    return vec3(dot(from_light, light.axis_x.xyz), dot(from_light, light.axis_y.xyz),
                dot(from_light, light.axis_z.xyz));
}
