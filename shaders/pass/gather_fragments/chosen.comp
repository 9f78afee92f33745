// As pass/gather/chosen.comp, of fragments: light of level 0, light of the rest, and with BD_VECTOR
// the vectors of both; with BD_SPREAD, in their a, how far off interpolated light may be; with
// BD_NOISE the noise of both.
#include "common/asker.glsl"
#include "common/blocks.glsl"
#include "common/chosen_light.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) uniform image2D light_0;
layout(binding = 1, rgba32f) uniform image2D light_1;
#ifdef BD_VECTOR
layout(binding = 2, rgba32f) uniform image2D vector_0;
layout(binding = 3, rgba32f) uniform image2D vector_1;
#endif
#ifdef BD_NOISE
layout(binding = 4, rgba32f) uniform image2D noise_0;
layout(binding = 5, rgba32f) uniform image2D noise_1;
#endif
#ifdef BD_SPREAD
layout(std430, binding = BD_STORAGE_PREFIX) readonly buffer prefix_block { float prefix[]; };
#endif

vec3 sum(halves h) { return h.even + h.odd; }

void main()
{
    asker_place asker = asker_place_at(gl_GlobalInvocationID.xy);
    if (!asker.exists) return;
    halves both = halves_of(asker.index, 0u);
    vec4 light = vec4(sum(both), 1.0);
    if (asker.level == 0u) imageStore(light_0, asker.block, light);
    else imageStore(light_1, in_stack(asker.level, asker.block), light);
#ifdef BD_NOISE
    vec4 noise = vec4(both.even - both.odd, 1.0);
    if (asker.level == 0u) imageStore(noise_0, asker.block, noise);
    else imageStore(noise_1, in_stack(asker.level, asker.block), noise);
#endif
#ifdef BD_VECTOR
    vec4 vector = vec4(sum(halves_of(asker.index, 1u)), 1.0);
#ifdef BD_SPREAD
    vector.a = prefix[args.running_sum_count * asker_count() + asker.index];
#endif
    if (asker.level == 0u) imageStore(vector_0, asker.block, vector);
    else imageStore(vector_1, in_stack(asker.level, asker.block), vector);
#endif
}
