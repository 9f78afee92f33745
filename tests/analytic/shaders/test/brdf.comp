// The BRDF of a list of surfaces with the normal +z: four vec4s in (base colour and metallic;
// roughness, f0; direction to the light; to the eye), one out: f, and the diffuse lobe's limit
// under the eye's cosine.
#include "common/brdf.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer case_block { vec4 cases[]; };
layout(std430, binding = 1) writeonly buffer result_block { vec4 results[]; };

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i >= uint(results.length())) return;
    vec4 colour = cases[4u * i], material = cases[4u * i + 1u];
    vec3 l = cases[4u * i + 2u].xyz, v = cases[4u * i + 3u].xyz;
    vec3 f = brdf(colour.rgb, colour.a, material.x, material.y, vec3(0.0, 0.0, 1.0), l, v);
    results[i] = vec4(f, diffuse_limit(v.z, material.x));
}
