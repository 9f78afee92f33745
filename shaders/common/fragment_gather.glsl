// The light that a block of pixels gathers, and where it is kept.
#include "common/block_receiver.glsl"
#include "shared/gather_fragments.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_gather_fragments_args args; };
layout(binding = 0, rgba32f) uniform image2D fine;
layout(binding = 1, rgba32f) uniform image2D coarse;
#ifdef BD_VECTOR
layout(binding = 2, rgba32f) uniform image2D fine_vector;
layout(binding = 3, rgba32f) uniform image2D coarse_vector;
#endif

// What earlier ranges left there. A macro, since no function may be given an image with a format.
#define EARLIER(image, at) (args.fragments.z != 0u ? vec3(0.0) : imageLoad(image, at).rgb)

// Adds a range of VPLs at a fragment.
void gather_at(uint level, ivec2 block)
{
    receiver r = block_receiver(level, block);
    sums s = no_light();
    uint end = args.vpls.x + (r.lit ? args.vpls.y : 0u);
    for (uint at = args.vpls.x; at < end; at += 32u)
        gather_block(s, r, vec3(0.0), at, min(at + 32u, end));
    if (level == 0u) {
        imageStore(fine, block, vec4(s.diffuse + EARLIER(fine, block), 1.0));
#ifdef BD_VECTOR
        imageStore(fine_vector, block, vec4(irradiance_vector(s, r.normal) + EARLIER(fine_vector, block), 1.0));
#endif
        return;
    }
    ivec2 at = in_stack(level, block);
    imageStore(coarse, at, vec4(s.diffuse + EARLIER(coarse, at), 1.0));
#ifdef BD_VECTOR
    imageStore(coarse_vector, at, vec4(irradiance_vector(s, r.normal) + EARLIER(coarse_vector, at), 1.0));
#endif
}
