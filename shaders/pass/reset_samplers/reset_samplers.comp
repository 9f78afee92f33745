// Samples one texture through every unit that a compute pass uses. See pass/reset_samplers.h.
layout(local_size_x = 1) in;
layout(binding = 0) uniform sampler2D maps[8];
layout(std430, binding = 0) writeonly buffer out_block { vec4 sum; };

void main()
{
    vec2 uv = vec2(gl_GlobalInvocationID.xy);
    sum = textureLod(maps[0], uv, 0.0) + textureLod(maps[1], uv, 0.0) +
          textureLod(maps[2], uv, 0.0) + textureLod(maps[3], uv, 0.0) +
          textureLod(maps[4], uv, 0.0) + textureLod(maps[5], uv, 0.0) +
          textureLod(maps[6], uv, 0.0) + textureLod(maps[7], uv, 0.0);
}
