// Smooths the light of fragments that few rays left noisy: each takes the mean over 5 x 5 blocks of
// its level, of one surface with it and no farther off than noise explains.
//
// One level of an a-trous filter (Dammertz, Sewtz, Hanika, Lensch 2010), whose noise is that of the
// halves: theirs is a guess from one pair, so that it is taken over the same blocks.
#include "kernel/all_channels.h"
#include "common/blocks.glsl"
#include "common/block_receiver.glsl"
#include "shared/gather_fragments.h"

layout(local_size_x = 64) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_gather_fragments_args args; };
layout(std430, binding = BD_STORAGE_FRAGMENTS) readonly buffer fragments_block { uint fragments[]; };
layout(binding = BD_UNIT_NOISY_LIGHT) uniform sampler2D light_in;
layout(binding = BD_UNIT_NOISE) uniform sampler2D noise_in;
layout(binding = 0, rgba32f) uniform writeonly image2D light_out;
#ifdef BD_VECTOR
layout(binding = BD_UNIT_NOISY_VECTOR) uniform sampler2D vector_in;
layout(binding = 1, rgba32f) uniform writeonly image2D vector_out;
#endif

const int REACH = 2;
// Differences of so many times what noise makes of two of them are light's own.
const float NOISE_REACH = 2.0;

// Where a block of the level is kept: level 0 has textures of its own.
ivec2 texel_of(uint level, ivec2 block) { return level == 0u ? block : in_stack(level, block); }

// Binomial weights.
float tent(int offset) { return offset == 0 ? 6.0 : abs(offset) == 1 ? 4.0 : 1.0; }

receiver surface_of(uint level, ivec2 block)
{
    return gbuffer_receiver(level == 0u ? block : representative_pixel(level, block));
}

// 0 for a block that holds no light, or is of another surface.
float weight_of(uint level, ivec2 block, ivec2 offset, receiver here)
{
    ivec2 other = block + offset;
    if (any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, blocks_of_level(level)))) return 0.0;
    if (texelFetch(light_in, texel_of(level, other), 0).a == 0.0) return 0.0;
    receiver there = surface_of(level, other);
    bool same = offset == ivec2(0) || (there.lit && is_one_surface(here, there));
    return same ? tent(offset.x) * tent(offset.y) : 0.0;
}

// Of the mean of both halves, squared, over the blocks around.
float noise_around(uint level, ivec2 block, receiver here)
{
    float sum = 0.0, weights = 0.0;
    for (int i = 0; i < 25; i++) {
        ivec2 offset = ivec2(i % 5, i / 5) - REACH;
        float weight = weight_of(level, block, offset, here);
        float noise = weight > 0.0
                          ? all_channels(texelFetch(noise_in, texel_of(level, block + offset), 0).rgb)
                          : 0.0;
        sum += weight * noise * noise;
        weights += weight;
    }
    return sum / max(weights, 1.0);
}

void main()
{
    if (gl_GlobalInvocationID.x >= args.fragment_count) return;
    uint fragment = fragments[args.first_fragment + gl_GlobalInvocationID.x];
    uint level = BD_FRAGMENT_LEVEL(fragment);
    ivec2 block = ivec2(BD_FRAGMENT_X(fragment), BD_FRAGMENT_Y(fragment)), at = texel_of(level, block);
    receiver here = surface_of(level, block);
    vec4 own = texelFetch(light_in, at, 0);
    float variance = 2.0 * NOISE_REACH * NOISE_REACH * args.variance_part * noise_around(level, block, here);
    vec3 light = vec3(0.0), vector = vec3(0.0);
    float weights = 0.0;
    for (int i = 0; i < 25; i++) {
        ivec2 offset = ivec2(i % 5, i / 5) - REACH, other = texel_of(level, block + offset);
        float weight = weight_of(level, block, offset, here);
        if (weight == 0.0) continue;
        vec3 theirs = texelFetch(light_in, other, 0).rgb;
        float off = all_channels(theirs - own.rgb);
        weight *= off == 0.0 ? 1.0 : exp(-off * off / max(variance, 1e-30));
        light += weight * theirs;
#ifdef BD_VECTOR
        vector += weight * texelFetch(vector_in, other, 0).rgb;
#endif
        weights += weight;
    }
    imageStore(light_out, at, vec4(light / weights, own.a));
#ifdef BD_VECTOR
    imageStore(vector_out, at, vec4(vector / weights, texelFetch(vector_in, at, 0).a));
#endif
}
