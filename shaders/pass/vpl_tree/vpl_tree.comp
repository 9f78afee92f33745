// One level of a tree of VPLs (shared/vpl_tree.h): leaves from the list, inner nodes from the four
// below them.
#include "common/array.glsl"
#include "common/light.glsl"
#include "common/morton.glsl"
#include "common/vpl_tree.glsl"
#include "shared/vpl.h"
#include "shared/vpl_tree.h"

layout(local_size_x = 64) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_vpl_tree_args args; };
BD_ARRAY(vpls, BD_UNIT_VPLS);
BD_ARRAY(vpl_quads, BD_UNIT_VPL_QUADS);
layout(std430, binding = BD_STORAGE_TREE_NODES) buffer node_block { vec4 nodes[]; };

const float FAR = 3.4e38;
const lobe NO_LOBE = lobe(vec3(0.0), vec3(0.0), 0.0);
const tree_node NOTHING = tree_node(vec3(0.0), vec3(0.0), vec3(0.0), vec3(FAR), vec3(-FAR),
                                    0.0, 0.0, 0.0, 0.0, 0.0, NO_LOBE);

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

// How far the patch's own normal is from the VPL's, which may be bent by a normal map.
float patch_chord(vec3 normal, vec3 u, vec3 v)
{
    vec3 across = cross(u, v);
    float size = length(across);
    if (!(size > 0.0)) return 0.0;
    across /= size;
    return min(length(across - normal), length(across + normal));
}

tree_node leaf(uint face, uint morton)
{
    uvec2 place = place_of_morton(morton);
    uint index = (face * args.faces.y + place.y) * args.faces.y + place.x;
    vec4 position = BD_LOAD(vpls, index * BD_VPL_VEC4S);
    vec4 normal = BD_LOAD(vpls, index * BD_VPL_VEC4S + 1u);
    vec3 flux = BD_LOAD(vpls, index * BD_VPL_VEC4S + 2u).rgb;
    vec4 u = BD_LOAD(vpl_quads, index * BD_VPL_QUAD_VEC4S);
    vec3 v = BD_LOAD(vpl_quads, index * BD_VPL_QUAD_VEC4S + 1u).xyz;
    if (!(strongest(flux) > 0.0)) return NOTHING;
    vec3 reach = abs(u.xyz) + abs(v), from_light = position.xyz - light.position.xyz;
    bool directional = light.kind.x == BD_LIGHT_KIND_DIRECTIONAL;
    tree_node n;
    n.position = position.xyz;
    n.area = position.w;
    n.normal = normal.xyz;
    n.chord = patch_chord(normal.xyz, u.xyz, v);
    n.flux = flux;
    n.radiosity = position.w > 0.0 ? strongest(flux) / position.w : FAR;
    n.box_min = position.xyz - reach;
    n.box_max = position.xyz + reach;
    n.light_distance2 = directional ? 1.0 : dot(from_light, from_light);
    n.near2 = normal.w;
    n.first = lobe(n.position, n.normal, 1.0);
    return n;
}

// Sum of the channels, rounded alike whatever their order.
float weight(tree_node n)
{
    float least = min(n.flux.r, min(n.flux.g, n.flux.b)), most = strongest(n.flux);
    float middle = max(min(n.flux.r, n.flux.g), min(max(n.flux.r, n.flux.g), n.flux.b));
    return least + middle + most;
}

// A number in steps of 1 / 2048 of itself: rounding, which changes with the light's power, must not
// choose between lobes that are equal.
float in_steps(float number)
{
    return uintBitsToFloat((floatBitsToUint(number) + 0x800u) & 0xfffff000u);
}

// How much of a lobe does not face along a unit vector.
float off_direction(lobe l, vec3 direction)
{
    return in_steps(length(l.normal) - dot(l.normal, direction));
}

vec3 direction_of(lobe l)
{
    float size = length(l.normal);
    return size > 0.0 ? l.normal / size : vec3(0.0);
}

const float NO_TIE = 1e-3;

// Of the children's eight lobes those that face rather as the largest than as the one that differs
// most from it.
lobe first_lobe(tree_node children[4], float sum)
{
    lobe lobes[8];
    for (int k = 0; k < 8; k++) {
        float share = weight(children[k >> 1]) / sum;
        lobes[k] = (k & 1) == 0 ? children[k >> 1].first : second_lobe(children[k >> 1]);
        lobes[k].share *= share;
        lobes[k].normal *= share;
    }
    int largest = 0, other = 0;
    for (int k = 1; k < 8; k++)
        if (in_steps(lobes[k].share) > in_steps(lobes[largest].share)) largest = k;
    vec3 direction = direction_of(lobes[largest]);
    for (int k = 1; k < 8; k++)
        if (off_direction(lobes[k], direction) > off_direction(lobes[other], direction)) other = k;
    vec3 other_direction = direction_of(lobes[other]);
    lobe first = NO_LOBE;
    for (int k = 0; k < 8; k++) {
        float nearer_other = dot(lobes[k].normal, other_direction - direction);
        if (nearer_other > NO_TIE * length(lobes[k].normal)) continue;
        first.position += lobes[k].share * lobes[k].position;
        first.normal += lobes[k].normal;
        first.share += lobes[k].share;
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
        n.box_min = min(n.box_min, children[k].box_min);
        n.box_max = max(n.box_max, children[k].box_max);
        n.light_distance2 = max(n.light_distance2, children[k].light_distance2);
    }
    float sum = weight(n);
    if (!(sum > 0.0)) return NOTHING;
    for (int k = 0; k < 4; k++) {
        float share = weight(children[k]) / sum;
        n.position += share * children[k].position;
        n.normal += share * children[k].normal;
    }
    for (int k = 0; k < 4; k++)
        if (weight(children[k]) > 0.0)
            n.chord = max(n.chord, children[k].chord + length(children[k].normal - n.normal));
    n.first = first_lobe(children, sum);
    return n;
}

void main()
{
    uint morton = gl_GlobalInvocationID.x + args.faces.z, face = gl_WorkGroupID.y;
    if (gl_GlobalInvocationID.x >= args.faces.w || face >= args.faces.x) return;
    uint first = face * args.level.z + args.level.y;
    tree_node n;
    if (args.level.w != 0u) {
        n = leaf(face, morton);
    } else {
        uint below = first + args.level.x + 4u * morton;
        tree_node children[4];
        for (uint k = 0u; k < 4u; k++) children[k] = load_node((below + k) * BD_TREE_NODE_VEC4S);
        n = parent(children);
    }
    store_node((first + morton) * BD_TREE_NODE_VEC4S, n);
}
