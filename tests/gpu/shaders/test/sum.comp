// Adds what is sampled at the mirrored place to what the storage block holds.
#include "test/size.glsl"
layout(local_size_x = 8, local_size_y = 4) in;
layout(binding = 3) uniform sampler2D source;
layout(std430, binding = 1) buffer sums { float sum[]; };

void main()
{
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 mirrored = ivec2(TEST_WIDTH - 1, TEST_HEIGHT - 1) - at;
    sum[at.y * TEST_WIDTH + at.x] += texelFetch(source, mirrored, 0).r;
}
