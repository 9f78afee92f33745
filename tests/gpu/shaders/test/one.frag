// VALUE comes from a define, so that two programs share one source.
flat in uint vertex_tag;
layout(location = 0) out vec4 color;

void main()
{
    color = vec4(VALUE, float(vertex_tag), gl_FragCoord.z, 1);
}
