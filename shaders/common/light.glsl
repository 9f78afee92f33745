// A punctual light as glTF defines it (KHR_lights_punctual).
#include "shared/bindings.h"
#include "shared/light.h"

layout(std140, binding = BD_UNIFORM_LIGHT) uniform light_block { bd_light_uniform light; };

// The recommended window of the extension: reaches 0 at the range.
float range_window(float distance)
{
    float x = distance * light.position.w;
    return clamp(1.0 - x * x * x * x, 0.0, 1.0);
}

float cone_attenuation(vec3 from_light)
{
    if (light.kind.x != BD_LIGHT_KIND_SPOT) return 1.0;
    float a = clamp((dot(from_light, light.direction.xyz) - light.cone.x) * light.cone.y, 0.0, 1.0);
    return a * a;
}

// Unit direction of face `face`'s axes in render space, in the order +x -x +y -y +z -z of the
// light's own frame; a light of one face looks along its direction (axis -z of its frame).
void light_face_axes(uint face, out vec3 x, out vec3 y, out vec3 z)
{
    vec3 X = light.axis_x.xyz, Y = light.axis_y.xyz, Z = light.axis_z.xyz;
    x = X; y = Y; z = Z;
    if (light.kind.y == 1u) return;
    switch (face) {
    case 0u: x = Z; z = -X; break;          // looks along +x
    case 1u: x = -Z; z = X; break;          // -x
    case 2u: y = Z; z = -Y; break;          // +y
    case 3u: y = -Z; z = Y; break;          // -y
    case 4u: x = -X; z = -Z; break;         // +z
    default: break;                         // -z
    }
}

// Face that sees a direction given relative to the light.
uint light_face_of(vec3 from_light)
{
    if (light.kind.y == 1u) return 0u;
    vec3 d = vec3(dot(from_light, light.axis_x.xyz), dot(from_light, light.axis_y.xyz),
                  dot(from_light, light.axis_z.xyz));
    vec3 a = abs(d);
    if (a.x >= a.y && a.x >= a.z) return d.x > 0.0 ? 0u : 1u;
    if (a.y >= a.z) return d.y > 0.0 ? 2u : 3u;
    return d.z > 0.0 ? 4u : 5u;
}
