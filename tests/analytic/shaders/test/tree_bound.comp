// Bounds of tree nodes: per case the node's seven vec4s, then the receiver's position and normal;
// one vec4 out.
#include "common/vpl_tree.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer case_block { vec4 cases[]; };
layout(std430, binding = 1) writeonly buffer result_block { vec4 results[]; };

void main()
{
    uint i = gl_GlobalInvocationID.x, at = i * (BD_TREE_NODE_VEC4S + 2u);
    if (i >= uint(results.length())) return;
    tree_node n = tree_node_of(cases[at], cases[at + 1u], cases[at + 2u], cases[at + 3u],
                               cases[at + 4u], cases[at + 5u], cases[at + 6u]);
    vec3 normal = cases[at + 8u].xyz;
    tree_bounds bounds = bounds_of(n, cases[at + 7u].xyz, normal, normal);
    results[i] = vec4(bounds.most, bounds.least, 0.0, 0.0);
}
