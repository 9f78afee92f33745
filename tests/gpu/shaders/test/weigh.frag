// The weight, once in one channel and once beside a count.
flat in float vertex_weight;
layout(location = 0) out vec4 color;
layout(location = 1) out float alone;

void main()
{
    color = vec4(vertex_weight, gl_FragCoord.z, 0, 1);
    alone = vertex_weight;
}
