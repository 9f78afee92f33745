flat in uint vertex_tag;
layout(location = 0) out uint primitive;
layout(location = 1) out uvec2 pair;
layout(location = 2) out vec4 wide;
layout(location = 3) out vec4 narrow;

void main()
{
    primitive = uint(gl_PrimitiveID) + 1u;
    pair = uvec2(vertex_tag, gl_FrontFacing ? 1u : 2u);
    wide = vec4(gl_FragCoord.xy, gl_FragCoord.z, -1.5);
    narrow = vec4(0.25, 0.5, 1, 65535.0 / 65535.0);
}
