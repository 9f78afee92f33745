// Layers of the picture from what the passes left; of several sub-frames their sums, which
// finish.comp divides.
//
// All that are asked for at once, by the same values, so that direct, indirect and emission add up
// to beauty: layers of light, or of surfaces. Colour in alpha 1 is one sub-frame's.
#include "common/gbuffer.glsl"
#include "common/pi.glsl"
#include "kernel/diffuse_limit.h"
#include "kernel/sent.h"
#include "pass/composite/finished.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) uniform image2D layers[BD_COMPOSITE_IMAGES];
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
// The doubt of each: half the difference of the pictures that each half of what is decided by chance
// would give, and in a the square of blur, a mean over channels.
#ifdef BD_AREA_DOUBT
layout(binding = BD_UNIT_AREA_DOUBT) uniform sampler2D area_doubt;
#endif
#ifdef BD_INDIRECT_DOUBT
layout(binding = BD_UNIT_INDIRECT_DOUBT) uniform sampler2D indirect_doubt;
#endif
#ifdef BD_GLOSSY_DOUBT
layout(binding = BD_UNIT_GLOSSY_DOUBT) uniform sampler2D glossy_doubt;
#endif
#ifdef BD_ROUGH_DOUBT
layout(binding = BD_UNIT_ROUGH_DOUBT) uniform sampler2D rough_doubt;
#endif
#ifdef BD_GLASS_DOUBT
layout(binding = BD_UNIT_GLASS_DOUBT) uniform sampler2D glass_doubt;
#endif

struct light {
    vec3 direct, indirect, emission;
    vec4 doubt;
};

// --- indirect light -----------------------------------------------------------------------------

#ifdef BD_INDIRECT
vec3 diffuse_albedo(receiver r)
{
#ifdef BD_LAMBERT
    return r.base_color;
#else
    return r.base_color * (1.0 - r.metallic);
#endif
}

// What the specular lobe of a rough surface reflects; a = 0 where that is not known.
vec4 rough_part(ivec2 pixel, receiver r)
{
#ifdef BD_ROUGH
    if (has_glossy_lobe(r.metallic, r.roughness)) return vec4(0.0);
    vec4 part = texelFetch(indirect_rough, pixel, 0);
    return part * part.a;
#else
    return vec4(0.0);
#endif
}

// With BD_WHOLE, of a surface without a lobe worth its price, what the diffuse part of its BRDF
// returns of light from everywhere to who looks; where nothing is known of what its lobe reflects,
// the whole BRDF.
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

vec4 indirect_doubt_of(ivec2 pixel, receiver r, vec3 reflected)
{
    vec4 doubt = vec4(0.0);
#ifdef BD_INDIRECT_DOUBT
    vec4 fallen = texelFetch(indirect_doubt, pixel, 0);
    vec3 share = reflected / PI;
    doubt = vec4(fallen.rgb * share, fallen.a * dot(share, share) / 3.0);
#endif
#ifdef BD_ROUGH_DOUBT
    if (!has_glossy_lobe(r.metallic, r.roughness)) doubt += texelFetch(rough_doubt, pixel, 0);
#endif
#ifdef BD_GLOSSY_DOUBT
    doubt += texelFetch(glossy_doubt, pixel, 0);
#endif
#ifndef BD_FILTERED
    doubt.a = 0.0;
#endif
    return doubt;
}

void add_indirect(ivec2 pixel, receiver r, inout light l)
{
    vec4 rough = rough_part(pixel, r);
    vec3 reflected = reflectance(r, rough);
    l.indirect = texelFetch(indirect_irradiance, pixel, 0).rgb * reflected / PI + rough.rgb;
#ifdef BD_GLOSSY
    // Its negative part is at most the irradiance's, up to rounding.
    l.indirect = max(l.indirect + texelFetch(indirect_glossy, pixel, 0).rgb, vec3(0.0));
#endif
    l.doubt += indirect_doubt_of(pixel, r, reflected);
}
#endif

// --- light --------------------------------------------------------------------------------------

light light_at(ivec2 pixel, receiver r)
{
    light l = light(vec3(0.0), vec3(0.0), vec3(0.0), vec4(0.0));
#ifdef BD_DIRECT
    l.direct += texelFetch(direct_radiance, pixel, 0).rgb;
#endif
#ifdef BD_AREA_LIGHT
    vec4 area = texelFetch(area_light, pixel, 0);
    if (area.a > 0.0) l.direct += area.rgb;
#endif
#ifdef BD_AREA_DOUBT
    l.doubt += texelFetch(area_doubt, pixel, 0);
#endif
#ifdef BD_INDIRECT
    if (r.lit) add_indirect(pixel, r, l);
#endif
#ifdef BD_GLASS
    l.indirect += texelFetch(shown_by_glass, pixel, 0).rgb;
#endif
#ifdef BD_GLASS_DOUBT
    l.doubt.rgb += texelFetch(glass_doubt, pixel, 0).rgb;
#endif
#ifdef BD_EMISSION
    l.emission = texelFetch(gbuffer_emission, pixel, 0).rgb;
#endif
    return l;
}

// Behind everything: what the sky shines, where it lights.
light sky_at(ivec2 pixel)
{
    light l = light(vec3(0.0), vec3(0.0), vec3(0.0), vec4(0.0));
#ifdef BD_AREA_LIGHT
    l.emission = texelFetch(area_light, pixel, 0).rgb;
#endif
    return l;
}

// --- layers -------------------------------------------------------------------------------------

// a = 1 where a surface is.
void put(ivec2 pixel, uint which, vec3 value, float there)
{
    vec4 sum = vec4(value, there);
    uint at = BD_COMPOSITE_IMAGE(which);
    if (args.is_first_sub_frame == 0u) sum += imageLoad(layers[at], pixel);
    imageStore(layers[at], pixel, args.is_only_sub_frame != 0u ? finished(which, sum) : sum);
}

void put_light(ivec2 pixel, light l, float there)
{
    float unit = args.unit_cd_m2;
#if BD_LAYERS & 1 << BD_COMPOSITE_BEAUTY
    put(pixel, uint(BD_COMPOSITE_BEAUTY), (l.direct + l.indirect + l.emission) * unit, there);
#endif
#if BD_LAYERS & 1 << BD_COMPOSITE_DIRECT
    put(pixel, uint(BD_COMPOSITE_DIRECT), l.direct * unit, there);
#endif
#if BD_LAYERS & 1 << BD_COMPOSITE_INDIRECT
    put(pixel, uint(BD_COMPOSITE_INDIRECT), l.indirect * unit, there);
#endif
#if BD_LAYERS & 1 << BD_COMPOSITE_EMISSION
    put(pixel, uint(BD_COMPOSITE_EMISSION), l.emission * unit, there);
#endif
#if BD_LAYERS & 1 << BD_COMPOSITE_NOISE
    put(pixel, uint(BD_COMPOSITE_NOISE), args.noise_sign * l.doubt.rgb * unit, there);
#endif
#if BD_LAYERS & 1 << BD_COMPOSITE_BLUR
    put(pixel, uint(BD_COMPOSITE_BLUR), vec3(l.doubt.a * unit * unit), there);
#endif
}

void put_surface(ivec2 pixel, receiver r, float there)
{
#if BD_LAYERS & 1 << BD_COMPOSITE_ALBEDO
    put(pixel, uint(BD_COMPOSITE_ALBEDO), there > 0.0 ? r.base_color : vec3(0.0), there);
#endif
#if BD_LAYERS & 1 << BD_COMPOSITE_NORMAL
    put(pixel, uint(BD_COMPOSITE_NORMAL), there > 0.0 ? r.normal : vec3(0.0), there);
#endif
#if BD_LAYERS & 1 << BD_COMPOSITE_DEPTH
    float depth = texelFetch(gbuffer_depth, pixel, 0).x * args.render_unit_m;
    put(pixel, uint(BD_COMPOSITE_DEPTH), vec3(there > 0.0 ? depth : 0.0), there);
#endif
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.first_row);
    if (pixel.x >= int(view.size_px.x) || gl_GlobalInvocationID.y >= args.row_count) return;
    bool is_there = texelFetch(gbuffer_material, pixel, 0).w != 0.0;
    float there = is_there ? 1.0 : 0.0;
    receiver r = gbuffer_receiver(pixel);
#if BD_LAYERS & BD_COMPOSITE_SURFACES
    put_surface(pixel, r, there);
#else
    light l = sky_at(pixel);
    if (is_there) l = light_at(pixel, r);
    put_light(pixel, l, there);
#endif
}
