// One filtered sample per invocation from a row of texture coordinates.
layout(local_size_x = 1) in;
layout(binding = 0) uniform sampler2D source;
layout(binding = 1) uniform sampler2DArray layers;
layout(std430, binding = 0) writeonly buffer result { vec4 found[]; };

void main()
{
    uint i = gl_GlobalInvocationID.x;
    found[2u * i] = textureLod(source, vec2((float(i) - 1.0) * 0.5 + 0.125, 0.5), 0.0);
    found[2u * i + 1u] = textureLod(layers, vec3(0.5, 0.5, float(i)), 0.0);
}
