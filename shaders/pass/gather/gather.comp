// Full-resolution gather (algorithms.md A0.7 N1): every pixel sums every VPL of a slice, in the
// order of the list. Without visibility, or with BD_VISIBLE those that the pixel sees: a word for
// each block of 32, pixels of the tile in rows.
//
// image 0: irradiance, demodulated: no receiver albedo in it.
// image 1 (BD_GLOSSY): what the whole BRDF reflects beyond that (common/vpl_gather.glsl).
#include "common/vpl_gather.glsl"
#include "shared/gather.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_gather_args args; };
layout(binding = 0, rgba32f) uniform image2D irradiance;
#ifdef BD_GLOSSY
layout(binding = 1, rgba32f) uniform image2D glossy;
#endif

#ifdef BD_VISIBLE
layout(std430, binding = BD_STORAGE_OCCLUDED) readonly buffer occluded_block { uint occluded[]; };
#endif

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy + uvec2(args.tile_x_px, args.tile_y_px));
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, uvec2(args.tile_width_px, args.tile_height_px)))) return;
    receiver r = gbuffer_receiver(pixel);
    vec3 viewer = direction_to_viewer(r.relative_position);
    bool first = args.is_first != 0u;
    sums s = no_light();
    uint end = args.first_vpl + (is_asked(r) ? args.vpl_count : 0u);
#ifdef BD_VISIBLE
    uint place = gl_GlobalInvocationID.y * args.tile_width_px + gl_GlobalInvocationID.x;
    uint word = place * ((args.vpl_count + 31u) / 32u);
#endif
    for (uint at = args.first_vpl; at < end; at += 32u) {
#ifdef BD_VISIBLE
        hidden = occluded[word++];
#endif
        gather_block(s, r, viewer, at, min(at + 32u, end));
    }
    if (!first) s.diffuse += imageLoad(irradiance, pixel).rgb;
    imageStore(irradiance, pixel, vec4(s.diffuse, 1.0));
#ifdef BD_GLOSSY
    if (!first) s.glossy += imageLoad(glossy, pixel).rgb;
    imageStore(glossy, pixel, vec4(s.glossy, 1.0));
#endif
}
