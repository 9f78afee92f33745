// Positions are clip coordinates; a second attribute travels along.
layout(location = 0) in vec4 position;
layout(location = 1) in uint tag;
layout(location = 2) in vec2 shift;
flat out uint vertex_tag;

void main()
{
    vertex_tag = tag;
    gl_Position = position + vec4(shift, 0, 0);
}
