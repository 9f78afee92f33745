// Direct light of one punctual light, added to those before it.
#include "common/brdf.glsl"
#include "common/gbuffer.glsl"
#include "common/shadow.glsl"
#include "shared/direct.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_direct_args args; };
layout(binding = BD_UNIT_GBUFFER_TRIANGLE) uniform usampler2D gbuffer_triangle;
layout(binding = 0, rgba32f) uniform image2D radiance;
#ifdef BD_IRRADIANCE
layout(binding = 1, rgba32f) uniform image2D irradiance_of_all;
#endif

// Vector to the light, its whole length, and the irradiance at normal incidence.
vec3 span_to_light(vec3 position, out vec3 irradiance)
{
    if (light.kind == BD_LIGHT_KIND_DIRECTIONAL) {
        irradiance = light.intensity.xyz;
        return -light.direction.xyz * light.distance;
    }
    vec3 span = light.position.xyz - position;
    irradiance = light.intensity.xyz * irradiance_at(span, light.direction.xyz, light.cos_outer,
                                                     light.per_cosine, light.inverse_range);
    return span;
}

// With what falls on it, `fallen`.
vec3 light_radiance(receiver r, ivec2 pixel, out vec3 fallen)
{
    fallen = vec3(0.0);
    vec3 irradiance;
    vec3 span = span_to_light(r.position, irradiance);
    if (irradiance == vec3(0.0)) return vec3(0.0);
    vec3 l = normalize(span);
    float cosine = dot(r.normal, l);
    if (cosine <= 0.0 || dot(r.normal_geometric, l) <= 0.0) return vec3(0.0);
    uint own_id = texelFetch(gbuffer_triangle, pixel, 0).x;
    vec3 origin = shadow_origin(r.position, r.relative_position, r.normal_geometric, l);
    if (light.kind != BD_LIGHT_KIND_DIRECTIONAL) span = light.position.xyz - origin;
    if (segment_is_blocked(origin, span, own_id)) return vec3(0.0);
    vec3 v = direction_to_viewer(r.relative_position);
    vec3 f = brdf(r.base_color, r.metallic, r.roughness, r.f0_dielectric, r.normal, l, v);
    fallen = irradiance * cosine;
    return f * irradiance * cosine;
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.first_row);
    if (pixel.x >= int(view.size_px.x) || gl_GlobalInvocationID.y >= args.row_count) return;
    receiver r = gbuffer_receiver(pixel);
    vec3 sum = args.is_first != 0u ? vec3(0.0) : imageLoad(radiance, pixel).rgb, fallen = vec3(0.0);
    if (r.lit) sum += light_radiance(r, pixel, fallen);
    imageStore(radiance, pixel, vec4(sum, 1.0));
#ifdef BD_IRRADIANCE
    if (args.is_first == 0u) fallen += imageLoad(irradiance_of_all, pixel).rgb;
    imageStore(irradiance_of_all, pixel, vec4(fallen, 1.0));
#endif
}
