// Sums a BD_ARRAY, beside a storage block of the same number.
#include "common/array.glsl"
layout(local_size_x = 1) in;
BD_ARRAY(values, 2);
layout(std430, binding = 2) writeonly buffer result { vec4 total; };

void main()
{
    vec4 sum = vec4(0);
    for (uint i = 0u; i < 10u; i++) sum += BD_LOAD(values, i);
    total = sum;
}
