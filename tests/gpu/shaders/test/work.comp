// Arithmetic that takes `rounds` steps an invocation.
layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer result { float found[]; };
layout(std140, binding = 0) uniform args { uint rounds; };

void main()
{
    float x = float(gl_GlobalInvocationID.x);
    for (uint i = 0u; i < rounds; i++) x = sin(x) + 1.0;
    found[gl_GlobalInvocationID.x & 4095u] = x;
}
