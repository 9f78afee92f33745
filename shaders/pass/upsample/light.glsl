// What the kernels of upsample share: light of blocks, and where it is kept.
//
// BD_FINE: of level 0, into `irradiance`; with BD_FINE_VECTOR, of pixels whose vectors are kept.
// BD_KEEP_VECTOR: and what they are before the pixel's own normal, for pass/shared_light. BD_DETAIL: BD_DETAIL_* of shared/upsample.h.
#include "common/gbuffer.glsl"
#include "kernel/all_channels.h"
#include "common/surfaces.glsl"
#include "shared/upsample.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_upsample_args args; };
layout(binding = 1, rgba32f) uniform image2D coarse;
#if BD_DETAIL == BD_DETAIL_DIRECTION
layout(binding = 3, rgba32f) uniform image2D coarse_vector;
#endif
#ifdef BD_FINE
layout(binding = 0, rgba32f) writeonly uniform image2D irradiance;
#ifdef BD_KEEP_VECTOR
layout(binding = 2, rgba32f) writeonly uniform image2D kept_irradiance;
layout(binding = 4, rgba32f) writeonly uniform image2D kept_vector;
#endif
layout(binding = BD_UNIT_FINE) uniform sampler2D fine;
#ifdef BD_FINE_VECTOR
layout(binding = BD_UNIT_FINE_VECTOR) uniform sampler2D fine_vector;
#endif
#endif

// In alpha: black is data.
const float GATHERED = 1.0;
const float INTERPOLATED = 0.5;

struct light {
    vec3 irradiance, vector;
    float state;
};

light stacked_light(bd_multires_level level, ivec2 block)
{
    ivec2 at = multires_texel(level, uvec2(block));
    vec4 e = imageLoad(coarse, at);
    light l = light(e.rgb, vec3(0.0), e.a);
#if BD_DETAIL == BD_DETAIL_DIRECTION
    l.vector = imageLoad(coarse_vector, at).xyz;
#endif
    return l;
}

light light_of_child(ivec2 block)
{
#ifdef BD_FINE
    vec4 e = texelFetch(fine, block, 0);
    light l = light(e.rgb, vec3(0.0), e.a);
#ifdef BD_FINE_VECTOR
    l.vector = texelFetch(fine_vector, block, 0).xyz;
#endif
    return l;
#else
    return stacked_light(args.level, block);
#endif
}

// Those of level 0 are put in by own.comp.
bool is_fragment(ivec2 child)
{
#ifdef BD_FINE
    return false;
#else
    return light_of_child(child).state == GATHERED;
#endif
}

// Between a block's centre and a quarter of its side from there, a straight line through it and its
// neighbour is off by this part of the second difference.
const float CURVATURE = 3.0 / 32.0;

void bend(inout light l, light before, light home, light after)
{
    l.irradiance -= CURVATURE * (before.irradiance - 2.0 * home.irradiance + after.irradiance);
    l.vector -= CURVATURE * (before.vector - 2.0 * home.vector + after.vector);
}

vec3 with_detail(light l, ivec2 pixel)
{
#if BD_DETAIL == BD_DETAIL_DIRECTION
    float of_fragments = all_channels(l.irradiance);
    float of_pixel = max(dot(l.vector, gbuffer_receiver(pixel).normal), 0.0);
    return of_fragments > 0.0 ? l.irradiance * min(of_pixel / of_fragments, 4.0) : vec3(0.0);
#elif BD_DETAIL == BD_DETAIL_PAPER
    const float ALPHA = 0.5;
    receiver here = gbuffer_receiver(pixel);
    float cosine = max(dot(direction_to_viewer(here.relative_position), here.normal), 0.0);
    return l.irradiance * (ALPHA * cosine + 1.0 - ALPHA);
#else
    return l.irradiance;
#endif
}

#ifdef BD_FINE
void keep(ivec2 pixel, light l)
{
#ifdef BD_KEEP_VECTOR
    imageStore(kept_irradiance, pixel, vec4(l.irradiance, l.state));
    imageStore(kept_vector, pixel, vec4(l.vector, l.state));
#endif
}
#endif

void store(ivec2 block, light l)
{
#ifdef BD_FINE
    keep(block, l);
    imageStore(irradiance, block, vec4(with_detail(l, block), l.state));
#else
    ivec2 at = multires_texel(args.level, uvec2(block));
    imageStore(coarse, at, vec4(l.irradiance, INTERPOLATED));
#if BD_DETAIL == BD_DETAIL_DIRECTION
    imageStore(coarse_vector, at, vec4(l.vector, 1.0));
#endif
#endif
}

