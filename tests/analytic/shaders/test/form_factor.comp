// Form factors of a list of parallelograms, each seen from the origin: four vec4s in (centre, u,
// v, normal of the receiver), one out.
#include "kernel/form_factor.h"

layout(local_size_x = 1) in;
layout(std430, binding = 0) readonly buffer case_block { vec4 cases[]; };
layout(std430, binding = 1) writeonly buffer result_block { vec4 results[]; };

void main()
{
    uint i = gl_GlobalInvocationID.x;
    float form_factor = quad_form_factor(cases[4u * i].xyz, cases[4u * i + 1u].xyz,
                                         cases[4u * i + 2u].xyz, cases[4u * i + 3u].xyz);
    results[i] = vec4(form_factor, 0.0, 0.0, 0.0);
}
