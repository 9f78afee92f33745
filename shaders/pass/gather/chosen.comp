// Light of the VPLs that were chosen for a receiver and that it sees. Those at even places and those
// at odd ones are two estimates of it; half their difference is the noise.
//
// Images, of pixels: irradiance; with BD_GLOSSY what is reflected beyond it; the noise of both.
#include "common/asker.glsl"
#include "common/chosen_light.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) uniform image2D irradiance;
#ifdef BD_GLOSSY
layout(binding = 1, rgba32f) uniform image2D glossy;
layout(binding = 3, rgba32f) uniform image2D noise_glossy;
#endif
layout(binding = 2, rgba32f) uniform image2D noise;

void main()
{
    asker_place asker = asker_place_at(gl_GlobalInvocationID.xy);
    if (!asker.exists) return;
    halves first = halves_of(asker.index, 0u);
    imageStore(irradiance, asker.block, vec4(first.even + first.odd, 1.0));
    imageStore(noise, asker.block, vec4(first.even - first.odd, 1.0));
#ifdef BD_GLOSSY
    halves lobe = halves_of(asker.index, 1u);
    imageStore(glossy, asker.block, vec4(lobe.even + lobe.odd, 1.0));
    imageStore(noise_glossy, asker.block, vec4(lobe.even - lobe.odd, 1.0));
#endif
}
