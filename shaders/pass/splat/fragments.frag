// What the vertex brings, to be blended.
flat in vec4 splat_light;
layout(location = 0) out vec4 light;
#ifdef BD_VECTOR
flat in vec4 splat_vector;
layout(location = 1) out vec4 vector;
#endif

void main()
{
    light = splat_light;
#ifdef BD_VECTOR
    vector = splat_vector;
#endif
}
