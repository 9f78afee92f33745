// Writes 100 * y + x + the uniform offset.
layout(local_size_x = 8, local_size_y = 4) in;
layout(binding = 0, r32f) uniform writeonly image2D target;
layout(std140, binding = 0) uniform args { float offset; };

void main()
{
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    imageStore(target, at, vec4(100.0 * float(at.y) + float(at.x) + offset, 0, 0, 0));
}
