// Back from the storage block to an image.
#include "test/size.h"
layout(local_size_x = 8, local_size_y = 4) in;
layout(binding = 0, r32f) uniform writeonly image2D target;
layout(std430, binding = 0) readonly buffer sums { float sum[]; };

void main()
{
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    imageStore(target, at, vec4(sum[at.y * TEST_WIDTH + at.x]));
}
