// Light of the VPLs that were chosen for a pixel and that it sees. Those at even places and those
// at odd ones are two estimates of it; half their difference is the noise.
#include "shared/bindings.h"
#include "shared/choose.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_choose_args args; };
layout(std430, binding = BD_STORAGE_OCCLUDED) readonly buffer occluded_block { uint occluded[]; };
layout(std430, binding = BD_STORAGE_PICKS) readonly buffer pick_block { vec4 picks[]; };
layout(binding = 0, rgba32f) uniform image2D irradiance;
#ifdef BD_GLOSSY
layout(binding = 1, rgba32f) uniform image2D glossy;
layout(binding = 3, rgba32f) uniform image2D noise_glossy;
#endif
layout(binding = 2, rgba32f) uniform image2D noise;

void main()
{
    uvec2 at = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(at, args.tile.zw))) return;
    ivec2 pixel = ivec2(at + args.tile.xy);
    uint first = (at.y * args.tile.z + at.x) * args.rays.x;
    vec3 even = vec3(0.0), odd = vec3(0.0), even_lobe = vec3(0.0), odd_lobe = vec3(0.0);
    for (uint i = 0u; i < args.rays.x; i++) {
        uint index = first + i;
        if ((occluded[index / 32u] >> index % 32u & 1u) != 0u) continue;
        vec3 light = picks[index * BD_PICK_VEC4S].rgb, lobe = vec3(0.0);
#ifdef BD_GLOSSY
        lobe = picks[index * BD_PICK_VEC4S + 1u].rgb;
#endif
        bool is_odd = (i & 1u) != 0u;
        even += is_odd ? vec3(0.0) : light;
        odd += is_odd ? light : vec3(0.0);
        even_lobe += is_odd ? vec3(0.0) : lobe;
        odd_lobe += is_odd ? lobe : vec3(0.0);
    }
    imageStore(irradiance, pixel, vec4(even + odd, 1.0));
    imageStore(noise, pixel, vec4(even - odd, 1.0));
#ifdef BD_GLOSSY
    imageStore(glossy, pixel, vec4(even_lobe + odd_lobe, 1.0));
    imageStore(noise_glossy, pixel, vec4(even_lobe - odd_lobe, 1.0));
#endif
}
