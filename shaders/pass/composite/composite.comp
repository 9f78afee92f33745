// One layer of the picture from what the passes left; of several sub-frames their sum, which
// finish.comp divides.
//
// The layers are formed by the same expressions for beauty as for themselves, so that direct,
// indirect and emission add up to it. Colour in alpha 1 is one sub-frame's.
#include "common/gbuffer.glsl"
#include "common/pi.glsl"
#include "kernel/diffuse_limit.h"
#include "kernel/sent.h"
#include "pass/composite/finished.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_composite_args args; };
layout(binding = 0, rgba32f) uniform image2D layer;
#ifdef BD_DIRECT
layout(binding = BD_UNIT_DIRECT) uniform sampler2D direct_radiance;
#endif
#ifdef BD_AREA_LIGHT
layout(binding = BD_UNIT_AREA_LIGHT) uniform sampler2D area_light;
#endif
#ifdef BD_INDIRECT
layout(binding = BD_UNIT_INDIRECT) uniform sampler2D indirect_irradiance;
#endif
#ifdef BD_GLOSSY
layout(binding = BD_UNIT_INDIRECT_GLOSSY) uniform sampler2D indirect_glossy;
#endif
#ifdef BD_ROUGH
layout(binding = BD_UNIT_INDIRECT_ROUGH) uniform sampler2D indirect_rough;
#endif
#ifdef BD_GLASS
layout(binding = BD_UNIT_GLASS) uniform sampler2D shown_by_glass;
#endif
#ifdef BD_EMISSION
layout(binding = BD_UNIT_GBUFFER_EMISSION) uniform sampler2D gbuffer_emission;
#endif

vec3 diffuse_albedo(receiver r)
{
#ifdef BD_LAMBERT
    return r.base_color;
#else
    return r.base_color * (1.0 - r.metallic);
#endif
}

// What the specular lobe of a rough surface reflects; a = 0 where that is not known. Of doubts it is.
vec4 rough_part(ivec2 pixel, receiver r)
{
#ifdef BD_ROUGH
    if (has_glossy_lobe(r.metallic, r.roughness)) return vec4(0.0);
    vec4 part = texelFetch(indirect_rough, pixel, 0);
#if BD_LAYER == BD_COMPOSITE_NOISE || BD_LAYER == BD_COMPOSITE_BLUR
    return part;
#else
    return part * part.a;
#endif
#else
    return vec4(0.0);
#endif
}

// Of indirect light. With BD_WHOLE, of a surface without a lobe worth its price, what the diffuse
// part of its BRDF returns of light from everywhere to who looks; where nothing is known of what its
// lobe reflects, the whole BRDF.
vec3 reflectance(receiver r, vec4 rough)
{
#ifdef BD_WHOLE
    float cosine = max(dot(direction_to_viewer(r.relative_position), r.normal), 0.0);
    vec3 limited = diffuse_limited(r.base_color, r.roughness, cosine);
    if (!has_glossy_lobe(r.metallic, r.roughness))
        return rough.a > 0.0 ? sent_by_diffuse(limited, r.f0_dielectric, cosine)
                             : sent_by_rough(limited, r.roughness, r.f0_dielectric, cosine);
#endif
    return diffuse_albedo(r);
}

vec3 direct_part(ivec2 pixel)
{
    vec3 sum = vec3(0.0);
#ifdef BD_DIRECT
    sum += texelFetch(direct_radiance, pixel, 0).rgb;
#endif
#ifdef BD_AREA_LIGHT
    vec4 area = texelFetch(area_light, pixel, 0);
    if (area.a > 0.0) sum += area.rgb;
#endif
    return sum;
}

vec3 indirect_part(ivec2 pixel, receiver r)
{
    vec3 sum = vec3(0.0);
#ifdef BD_INDIRECT
    vec4 rough = rough_part(pixel, r);
    if (r.lit) sum = texelFetch(indirect_irradiance, pixel, 0).rgb * reflectance(r, rough) / PI + rough.rgb;
#endif
#ifdef BD_GLOSSY
    // Its negative part is at most the irradiance's, up to rounding.
    if (r.lit) sum = max(sum + texelFetch(indirect_glossy, pixel, 0).rgb, vec3(0.0));
#endif
#ifdef BD_GLASS
    sum += texelFetch(shown_by_glass, pixel, 0).rgb;
#endif
    return sum;
}

// Half the difference of the pictures that each half of what is decided by chance would give.
vec3 noise_part(ivec2 pixel, receiver r)
{
    vec3 sum = vec3(0.0);
#ifdef BD_AREA_LIGHT
    sum += texelFetch(area_light, pixel, 0).rgb;
#endif
#ifdef BD_INDIRECT
    vec4 rough = rough_part(pixel, r);
    if (r.lit) sum += texelFetch(indirect_irradiance, pixel, 0).rgb * reflectance(r, rough) / PI + rough.rgb;
#endif
#ifdef BD_GLOSSY
    if (r.lit) sum += texelFetch(indirect_glossy, pixel, 0).rgb;
#endif
#ifdef BD_GLASS
    sum += texelFetch(shown_by_glass, pixel, 0).rgb;
#endif
    return sum;
}

// The square of blur, a mean over channels, each light's own.
float blur_part(ivec2 pixel, receiver r)
{
    float sum = 0.0;
#ifdef BD_AREA_LIGHT
    sum += texelFetch(area_light, pixel, 0).a;
#endif
#ifdef BD_INDIRECT
    vec4 rough = rough_part(pixel, r);
    vec3 albedo = reflectance(r, rough) / PI;
    if (r.lit) sum += texelFetch(indirect_irradiance, pixel, 0).a * dot(albedo, albedo) / 3.0 + rough.a;
#endif
#ifdef BD_GLOSSY
    if (r.lit) sum += texelFetch(indirect_glossy, pixel, 0).a;
#endif
    return sum;
}

vec3 emission_part(ivec2 pixel)
{
#ifdef BD_EMISSION
    return texelFetch(gbuffer_emission, pixel, 0).rgb;
#else
    return vec3(0.0);
#endif
}

// Behind everything: what the sky shines, where it lights.
vec3 sky_part(ivec2 pixel)
{
#if defined(BD_AREA_LIGHT) && (BD_LAYER == BD_COMPOSITE_BEAUTY || BD_LAYER == BD_COMPOSITE_EMISSION)
    return texelFetch(area_light, pixel, 0).rgb * args.unit_cd_m2;
#else
    return vec3(0.0);
#endif
}

// rgb = the layer's value for this sub-frame, a = 1 where a surface is.
vec4 sub_frame_value(ivec2 pixel)
{
    float covered = texelFetch(gbuffer_material, pixel, 0).w;
    if (covered == 0.0) return vec4(sky_part(pixel), 0.0);
    receiver r = gbuffer_receiver(pixel);
    vec3 value = vec3(0.0);
#if BD_LAYER == BD_COMPOSITE_BEAUTY
    value = (direct_part(pixel) + indirect_part(pixel, r) + emission_part(pixel)) * args.unit_cd_m2;
#elif BD_LAYER == BD_COMPOSITE_DIRECT
    value = direct_part(pixel) * args.unit_cd_m2;
#elif BD_LAYER == BD_COMPOSITE_INDIRECT
    value = indirect_part(pixel, r) * args.unit_cd_m2;
#elif BD_LAYER == BD_COMPOSITE_EMISSION
    value = emission_part(pixel) * args.unit_cd_m2;
#elif BD_LAYER == BD_COMPOSITE_NOISE
    value = args.noise_sign * noise_part(pixel, r) * args.unit_cd_m2;
#elif BD_LAYER == BD_COMPOSITE_BLUR
    value = vec3(blur_part(pixel, r) * args.unit_cd_m2 * args.unit_cd_m2);
#elif BD_LAYER == BD_COMPOSITE_ALBEDO
    value = r.base_color;
#elif BD_LAYER == BD_COMPOSITE_NORMAL
    value = r.normal;
#elif BD_LAYER == BD_COMPOSITE_DEPTH
    value = vec3(texelFetch(gbuffer_depth, pixel, 0).x * args.render_unit_m);
#endif
    return vec4(value, 1.0);
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.first_row);
    if (pixel.x >= int(view.size_px.x) || gl_GlobalInvocationID.y >= args.row_count) return;
    vec4 sum = sub_frame_value(pixel);
    if (args.is_first_sub_frame == 0u) sum += imageLoad(layer, pixel);
    imageStore(layer, pixel, args.is_only_sub_frame != 0u ? finished(sum) : sum);
}
