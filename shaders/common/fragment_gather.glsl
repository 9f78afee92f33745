// The light that a block of pixels gathers, and where it is kept. BD_FINE: of pixels, level 0.
// BD_VISIBLE: of VPLs that it sees.
#include "common/block_receiver.glsl"
#include "shared/gather_fragments.h"

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_gather_fragments_args args; };
layout(binding = 0, rgba32f) uniform image2D light;
#ifdef BD_VECTOR
layout(binding = 1, rgba32f) uniform image2D vectors;
#endif

#ifdef BD_VISIBLE
layout(std430, binding = BD_STORAGE_OCCLUDED) readonly buffer occluded_block { uint occluded[]; };
#endif

// What earlier ranges left there. A macro, since no function may be given an image with a format.
#define EARLIER(image, at) (args.is_first != 0u ? vec3(0.0) : imageLoad(image, at).rgb)

#ifdef BD_SPREAD
float earlier_spread(ivec2 at)
{
    return args.is_first != 0u ? 0.0 : imageLoad(vectors, at).a;
}
#endif

// Adds a range of VPLs at a fragment, the one of that index in the slice.
void gather_at(uint level, ivec2 block, uint index)
{
    receiver r = block_receiver(level, block);
    sums s = no_light();
#ifdef BD_SPREAD
    s.spread = spread_of_block(level, r, args.finest_level);
#endif
    uint end = args.first_vpl + (r.lit ? args.vpl_count : 0u);
    for (uint at = args.first_vpl; at < end; at += 32u) {
#ifdef BD_VISIBLE
        hidden = occluded[index * args.words_per_receiver + (at - args.first_vpl) / 32u];
#endif
        gather_block(s, r, vec3(0.0), at, min(at + 32u, end));
    }
#ifdef BD_FINE
    ivec2 at = block;
#else
    ivec2 at = in_stack(level, block);
#endif
    imageStore(light, at, vec4(s.diffuse + EARLIER(light, at), 1.0));
#ifdef BD_VECTOR
    float spread = 1.0;
#ifdef BD_SPREAD
    spread = s.spread.sum + earlier_spread(at);
#endif
    vec3 vector = irradiance_vector(s, r.normal) + EARLIER(vectors, at);
    imageStore(vectors, at, vec4(vector, spread));
#endif
}
