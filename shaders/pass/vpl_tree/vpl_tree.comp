// One level of a tree of VPLs (shared/vpl_tree.h): leaves from the list, inner nodes from the four
// below them.
#include "common/array.glsl"
#include "common/light.glsl"
#include "common/morton.glsl"
#include "common/vpl_tree.glsl"
#include "kernel/vpl_tree_build.h"
#include "shared/vpl.h"
#include "shared/vpl_tree.h"

layout(local_size_x = 64) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_vpl_tree_args args; };
BD_ARRAY(vpls, BD_UNIT_VPLS);
BD_ARRAY(vpl_quads, BD_UNIT_VPL_QUADS);
layout(std430, binding = BD_STORAGE_TREE_NODES) buffer node_block { vec4 nodes[]; };

const lobe NO_LOBE = lobe(vec3(0.0), vec3(0.0), 0.0);
const tree_node NOTHING =
    tree_node(vec3(0.0), vec3(0.0), vec3(0.0), vec3(TREE_FAR), vec3(-TREE_FAR), 0.0, 0.0, 0.0, 0.0,
              0.0, NO_LOBE);

void store_node(uint at, tree_node n)
{
    nodes[at] = vec4(n.position, n.area);
    nodes[at + 1u] = vec4(n.normal, n.chord);
    nodes[at + 2u] = vec4(n.flux, n.radiosity);
    nodes[at + 3u] = vec4(n.box_min, n.light_distance2);
    nodes[at + 4u] = vec4(n.box_max, n.near2);
    nodes[at + 5u] = vec4(n.first.position, n.first.share);
    nodes[at + 6u] = vec4(n.first.normal, 0.0);
}

tree_node load_node(uint at)
{
    return tree_node_of(nodes[at], nodes[at + 1u], nodes[at + 2u], nodes[at + 3u], nodes[at + 4u],
                        nodes[at + 5u], nodes[at + 6u]);
}

tree_node leaf(uint face, uint morton)
{
    uvec2 place = place_of_morton(morton);
    uint index = (face * args.leaf_side + place.y) * args.leaf_side + place.x;
    vec4 position = BD_LOAD(vpls, index * BD_VPL_VEC4S);
    vec4 normal = BD_LOAD(vpls, index * BD_VPL_VEC4S + 1u);
    vec3 flux = BD_LOAD(vpls, index * BD_VPL_VEC4S + 2u).rgb;
    vec3 u = BD_LOAD(vpl_quads, index * BD_VPL_QUAD_VEC4S).xyz;
    vec3 v = BD_LOAD(vpl_quads, index * BD_VPL_QUAD_VEC4S + 1u).xyz;
    if (!(strongest(flux) > 0.0)) return NOTHING;
    tree_node n;
    n.position = position.xyz;
    n.area = position.w;
    n.normal = normal.xyz;
    n.chord = patch_chord(normal.xyz, u, v);
    n.flux = flux;
    n.radiosity = radiosity_of_vpl(flux, position.w);
    n.box_min = position.xyz - patch_reach(u, v);
    n.box_max = position.xyz + patch_reach(u, v);
    n.light_distance2 = distance2_of_light(position.xyz, light.position.xyz,
                                           light.kind == BD_LIGHT_KIND_DIRECTIONAL);
    n.near2 = normal.w;
    n.first = lobe(n.position, n.normal, 1.0);
    return n;
}

lobe first_lobe(tree_node children[4], float shares[4])
{
    lobe lobes[8];
    for (int k = 0; k < 8; k++) {
        lobes[k] = (k & 1) == 0 ? children[k >> 1].first : second_lobe(children[k >> 1]);
        lobes[k].share *= shares[k >> 1];
        lobes[k].normal *= shares[k >> 1];
    }
    int largest = 0, other = 0;
    for (int k = 1; k < 8; k++)
        if (in_steps(lobes[k].share) > in_steps(lobes[largest].share)) largest = k;
    vec3 direction = direction_of_lobe(lobes[largest].normal);
    for (int k = 1; k < 8; k++)
        if (off_direction(lobes[k].normal, direction) >
            off_direction(lobes[other].normal, direction))
            other = k;
    vec3 other_direction = direction_of_lobe(lobes[other].normal);
    lobe first = NO_LOBE;
    for (int k = 0; k < 8; k++) {
        float part = part_of_first(lobes[k].normal, direction, other_direction);
        first.position += part * lobes[k].share * lobes[k].position;
        first.normal += part * lobes[k].normal;
        first.share += part * lobes[k].share;
    }
    first.position /= first.share;
    return first;
}

tree_node parent(tree_node children[4])
{
    tree_node n = NOTHING;
    for (int k = 0; k < 4; k++) {
        n.flux += children[k].flux;
        n.area += children[k].area;
        n.radiosity += children[k].radiosity;
        n.box_min = least_corner(n.box_min, children[k].box_min);
        n.box_max = greatest_corner(n.box_max, children[k].box_max);
        n.light_distance2 = max(n.light_distance2, children[k].light_distance2);
    }
    if (!(strongest(n.flux) > 0.0)) return NOTHING;
    float shares[4];
    for (int k = 0; k < 4; k++) {
        shares[k] = share_of_child(children[k].flux, n.flux);
        n.position += shares[k] * children[k].position;
        n.normal += shares[k] * children[k].normal;
    }
    for (int k = 0; k < 4; k++)
        n.chord = max(n.chord, chord_with_child(children[k].flux, children[k].normal,
                                                children[k].chord, n.normal));
    n.first = first_lobe(children, shares);
    return n;
}

void main()
{
    uint morton = gl_GlobalInvocationID.x + args.first_node, face = gl_WorkGroupID.y;
    if (gl_GlobalInvocationID.x >= args.node_count || face >= args.face_count) return;
    uint first = face * args.face_node_count + args.level_first_node;
    tree_node n;
    if (args.has_leaves != 0u) {
        n = leaf(face, morton);
    } else {
        uint below = first + args.level_node_count + 4u * morton;
        tree_node children[4];
        for (uint k = 0u; k < 4u; k++) children[k] = load_node((below + k) * BD_TREE_NODE_VEC4S);
        n = parent(children);
    }
    store_node((first + morton) * BD_TREE_NODE_VEC4S, n);
}
