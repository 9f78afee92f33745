// Counts of an indirect dispatch, behind two numbers that are none of its business.
layout(local_size_x = 1) in;
layout(std140, binding = 0) uniform args { uvec4 counts; };
layout(std430, binding = 0) writeonly buffer commands { uint words[5]; };

void main()
{
    words[0] = words[1] = 9u;
    for (int i = 0; i < 3; i++) words[2 + i] = counts[i];
}
