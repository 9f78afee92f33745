flat in uint vertex_tag;
layout(location = 0) out vec4 color;
layout(std140, binding = 0) uniform args { uint rounds; };

void main()
{
    float x = gl_FragCoord.x + float(vertex_tag) + 1e-12 * float(SALT);
    for (uint i = 0u; i < rounds; i++) x = sin(x) + 1.0;
    color = vec4(x);
}
