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
#endif
layout(binding = 2, rgba32f) uniform image2D noise;

void main()
{
    uvec2 at = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(at, args.tile.zw))) return;
    ivec2 pixel = ivec2(at + args.tile.xy);
    uint first = (at.y * args.tile.z + at.x) * args.rays.x;
    vec3 even = vec3(0.0), odd = vec3(0.0), lobe = vec3(0.0);
    for (uint i = 0u; i < args.rays.x; i++) {
        uint index = first + i;
        bool seen = (occluded[index / 32u] >> index % 32u & 1u) == 0u;
        vec3 light = seen ? picks[index * BD_PICK_VEC4S].rgb : vec3(0.0);
#ifdef BD_GLOSSY
        if (seen) lobe += picks[index * BD_PICK_VEC4S + 1u].rgb;
#endif
        if ((i & 1u) == 0u)
            even += light;
        else
            odd += light;
    }
    imageStore(irradiance, pixel, vec4(even + odd, 1.0));
    imageStore(noise, pixel, vec4(even - odd, 1.0));
#ifdef BD_GLOSSY
    imageStore(glossy, pixel, vec4(lobe, 1.0));
#endif
}
