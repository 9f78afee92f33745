// What the filter of light is guided by: the shading normal, and the depth along the view's axis;
// nothing where there is no light to be filtered.
#include "common/gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) writeonly uniform image2D guides;

void main()
{
    uvec2 at = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(at, view.size_px.xy))) return;
    ivec2 pixel = ivec2(at);
    receiver r = gbuffer_receiver(pixel);
    float depth = texelFetch(gbuffer_depth, pixel, 0).x;
    imageStore(guides, pixel, r.lit ? vec4(r.normal, depth) : vec4(0.0));
}
