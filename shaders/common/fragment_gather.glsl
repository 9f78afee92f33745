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

#ifdef BD_SPREAD
// A surface that is seen more aslant than this is not taken for longer.
const float LONGEST_COSINE = 0.2;

// Blocks of the finest level and below may hold several surfaces.
light_spread spread_of_block(uint level, receiver r)
{
    float depth = view_is_orthographic() ? 1.0 : -dot(view.axis_z.xyz, r.relative_position);
    float half_pixel = view.axis_x.w / float(view.size_px.x) * depth;
    float cosine = abs(dot(direction_to_viewer(r.relative_position), r.normal_geometric));
    float radius = half_pixel * exp2(float(level)) / max(cosine, LONGEST_COSINE);
    return light_spread(0.0, radius, level <= args.fragments.w ? 1.0 : 0.0);
}

float earlier_spread(ivec2 at) { return args.fragments.z != 0u ? 0.0 : imageLoad(coarse_vector, at).a; }
#endif

// Adds a range of VPLs at a fragment.
void gather_at(uint level, ivec2 block)
{
    receiver r = block_receiver(level, block);
    sums s = no_light();
#ifdef BD_SPREAD
    s.spread = spread_of_block(level, r);
#endif
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
    float spread = 1.0;
#ifdef BD_SPREAD
    spread = s.spread.sum + earlier_spread(at);
#endif
    imageStore(coarse_vector, at, vec4(irradiance_vector(s, r.normal) + EARLIER(coarse_vector, at), spread));
#endif
}
