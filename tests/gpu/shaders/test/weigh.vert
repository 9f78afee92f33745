// Positions are clip coordinates; a weight of either the vertex or the instance travels along.
layout(location = 0) in vec4 position;
layout(location = 1) in float weight;
flat out float vertex_weight;

void main()
{
    vertex_weight = weight;
    gl_Position = position;
}
