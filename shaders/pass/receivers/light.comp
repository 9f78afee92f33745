// Stores the light that loops over lanes summed for the receivers of a slice (shared/receivers.h):
// of pixels irradiance; of fragments that of level 0 and of the rest, and with BD_VECTOR the vectors
// of both, with BD_SPREAD the spread in their a. With BD_NOISE the noise of the light, too;
// with BD_GLOSSY what lobes of pixels reflect, with BD_ROUGH that of rough dielectrics in an image of
// its own. With BD_ADDS all but the spread are added to what is there.
#include "common/asker.glsl"
#ifdef BD_FRAGMENTS
#include "common/blocks.glsl"
#endif
#ifdef BD_ROUGH
#include "common/gbuffer.glsl"
#endif
#include "shared/receivers.h"

layout(local_size_x = 64) in;
layout(std430, binding = BD_STORAGE_RECEIVER_LIGHT) readonly buffer light_block { float light[]; };
layout(binding = 0, rgba32f) uniform image2D light_0;
#ifdef BD_FRAGMENTS
layout(binding = 1, rgba32f) uniform image2D light_1;
#ifdef BD_VECTOR
layout(binding = 2, rgba32f) uniform image2D vector_0;
layout(binding = 3, rgba32f) uniform image2D vector_1;
#endif
#ifdef BD_NOISE
layout(binding = 4, rgba32f) uniform image2D noise_0;
layout(binding = 5, rgba32f) uniform image2D noise_1;
#endif
#elif defined(BD_NOISE)
layout(binding = 2, rgba32f) uniform image2D noise_0;
#endif
#ifdef BD_GLOSSY
layout(std430, binding = BD_STORAGE_GLOSSY_LIGHT) readonly buffer glossy_block { float glossy[]; };
layout(binding = 1, rgba32f) uniform image2D glossy_0;
#endif
#ifdef BD_ROUGH
layout(binding = 3, rgba32f) uniform image2D rough_0;
#endif

float field(uint index, uint which)
{
    return light[(index / BD_LANES * BD_LIGHT_FIELDS + which) * BD_LANES + index % BD_LANES];
}

vec4 vector_field(uint index, uint which, float a)
{
    return vec4(field(index, which), field(index, which + 1u), field(index, which + 2u), a);
}

#ifdef BD_GLOSSY
vec4 glossy_light(uint index)
{
    uint first = index / BD_LANES * BD_GLOSSY_LIGHT_FIELDS * BD_LANES + index % BD_LANES;
    return vec4(glossy[first], glossy[first + BD_LANES], glossy[first + 2u * BD_LANES], 1.0);
}

#ifdef BD_ROUGH
bool is_rough(ivec2 pixel)
{
    return !has_glossy_lobe(texelFetch(gbuffer_albedo, pixel, 0).a, texelFetch(gbuffer_material, pixel, 0).x);
}
#endif

vec4 added(vec4 lobes, vec4 earlier)
{
#ifdef BD_ADDS
    return vec4(earlier.rgb + lobes.rgb, earlier.a);
#else
    return lobes;
#endif
}

void store_lobes(ivec2 pixel, vec4 lobes)
{
#ifdef BD_ROUGH
    if (is_rough(pixel)) {
        imageStore(rough_0, pixel, added(lobes, imageLoad(rough_0, pixel)));
        return;
    }
#endif
    imageStore(glossy_0, pixel, added(lobes, imageLoad(glossy_0, pixel)));
}
#endif

void main()
{
    uint index = gl_GlobalInvocationID.x;
    asker_place asker = asker_place_at(uvec2(index % args.tile_width, index / args.tile_width));
    if (!asker.exists) return;
    vec4 irradiance = vector_field(index, BD_LIGHT_IRRADIANCE, 1.0);
#ifdef BD_FRAGMENTS
    ivec2 at = asker.level == 0u ? asker.block : in_stack(asker.level, asker.block);
#ifdef BD_ADDS
    irradiance.rgb += (asker.level == 0u ? imageLoad(light_0, at) : imageLoad(light_1, at)).rgb;
#endif
    if (asker.level == 0u) imageStore(light_0, at, irradiance);
    else imageStore(light_1, at, irradiance);
#ifdef BD_NOISE
    vec4 noise = vector_field(index, BD_LIGHT_NOISE, 1.0);
#ifdef BD_ADDS
    noise.rgb += (asker.level == 0u ? imageLoad(noise_0, at) : imageLoad(noise_1, at)).rgb;
#endif
    if (asker.level == 0u) imageStore(noise_0, at, noise);
    else imageStore(noise_1, at, noise);
#endif
#ifdef BD_VECTOR
    float spread = 1.0;
#ifdef BD_SPREAD
    spread = asker.level == 0u ? 1.0 : field(index, BD_LIGHT_SPREAD);
#endif
    vec4 vector = vector_field(index, BD_LIGHT_VECTOR, spread);
#ifdef BD_ADDS
    vector.rgb += (asker.level == 0u ? imageLoad(vector_0, at) : imageLoad(vector_1, at)).rgb;
#endif
    if (asker.level == 0u) imageStore(vector_0, at, vector);
    else imageStore(vector_1, at, vector);
#endif
#else
#ifdef BD_ADDS
    irradiance.rgb += imageLoad(light_0, asker.block).rgb;
#endif
    imageStore(light_0, asker.block, irradiance);
#ifdef BD_NOISE
    vec4 noise = vector_field(index, BD_LIGHT_NOISE, 1.0);
#ifdef BD_ADDS
    noise.rgb += imageLoad(noise_0, asker.block).rgb;
#endif
    imageStore(noise_0, asker.block, noise);
#endif
#ifdef BD_GLOSSY
    store_lobes(asker.block, glossy_light(index));
#endif
#endif
}
