// Nodes of the cuts of all lights' trees, as a receiver chooses among them.
//
// A pick that is being looked for is a node: its root, its level and place there, what it gives,
// its light from 1 on; then how far into the node the choice falls. Found, it is as shared/choose.h
// has it, and its light is 0.
#include "common/tree_walk.glsl" // before what else includes is
#include "common/vpl_walk.glsl"

layout(std430, binding = BD_STORAGE_PICKS) buffer pick_block { uvec4 picks[]; };

const uint NO_ROOT = 0xffffffffu;

// Sums of a receiver, a row each: up to each light; how far off interpolated light may be; while
// picks are looked for the running sum, and how many were found.
uint light_of_walk() { return args.light_index; }
uint light_count() { return args.running_sum_count; }
uint row_of_spread() { return light_count(); }
uint row_of_running() { return light_count() + 1u; }
uint row_of_picks() { return light_count() + 2u; }

// What a node gives a receiver, all channels: exact for a leaf that is far.
float node_strength(receiver r, vec3 viewer, place at, tree_node n, tree_bounds bounds)
{
    if (!(bounds.most > 0.0)) return 0.0;
#ifndef BD_PRINTED
    if (!is_inner(at.level)) {
        vec4 position_area = vec4(n.position, n.area), normal_near = vec4(n.normal, n.near2);
        return strength(r, viewer, virtual_light(position_area, normal_near, n.flux));
    }
#endif
    return all_channels(light_of(r, n, at.level, bounds.most).irradiance);
}

// Where an asker's walk begins in this round; its end where it is done.
uint first_root(asker_place asker, receiver r)
{
    uint end = tree_args.first_root + tree_args.root_count;
    if (!r.lit) return end;
    return tree_args.is_resumed == 0u ? tree_args.first_root : next_roots[asker.index];
}

void keep_root(asker_place asker, walk w)
{
    next_roots[asker.index] = w.at.root;
    if (w.at.root < tree_args.first_root + tree_args.root_count) unfinished_round = tree_args.round;
}
