// Nodes of the cuts for a receiver in proportion to what they would give it, by systematic sampling
// over the running sum along its walk (common/systematic.glsl): picks of a range, for which it walks
// all trees. Only which nodes: pick.comp finds the leaves.
#include "common/tree_choice.glsl"
#include "common/systematic.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// How far a receiver's walk has come.
struct choosing {
    float running, total;
    uint pick; // the next
};

choosing choosing_so_far(uint place, receiver r)
{
    float total = r.lit ? prefix[place_of_prefix(light_count() - 1u, place)] : 0.0;
    if (light_of_walk() == 0u && tree_args.is_resumed == 0u) return choosing(0.0, total, args.first_item);
    uint pick = floatBitsToUint(prefix[place_of_prefix(row_of_picks(), place)]);
    return choosing(prefix[place_of_prefix(row_of_running(), place)], total, pick);
}

uint picks_end() { return args.first_item + args.item_count; }

void forget_picks(uint first)
{
    for (uint i = args.first_item; i < picks_end(); i++)
        picks[(first + i) * BD_PICK_VEC4S] = uvec4(NO_ROOT, 0u, 0u, 1u);
}

void store_node(uint index, place at, float own, float into)
{
    uint level_morton = at.level << 28u | at.morton;
    picks[index * BD_PICK_VEC4S] =
        uvec4(at.root, level_morton, floatBitsToUint(own), light_of_walk() + 1u);
    picks[index * BD_PICK_VEC4S + 1u] = uvec4(floatBitsToUint(into), 0u, 0u, 0u);
}

void main()
{
    asker_place asker = asker_place_at(gl_GlobalInvocationID.xy);
    if (!asker.exists) return;
    ivec2 pixel;
    receiver r = asker_receiver(asker, pixel);
    vec3 viewer = direction_to_viewer(r.relative_position);
    float estimate = estimate_of(asker.index);
    choosing c = choosing_so_far(asker.index, r);
    float part = c.total / float(args.rays_per_receiver), start = place_in_part(uvec2(asker.block)) * part;
    uint first = asker.index * args.rays_per_receiver;
    if (light_of_walk() == 0u && tree_args.is_resumed == 0u) forget_picks(first);
    walk w = walk_from(first_root(asker, r));
    cut_node node;
    while (w.at.root < w.end) {
        if (!takes_next(r, w, estimate, node)) continue;
        float own = node_strength(r, viewer, node.at, node.n, node.bounds);
        float target = start + float(c.pick) * part;
        while (target < c.running + own && c.pick < picks_end()) {
            store_node(first + c.pick, node.at, own, clamp((target - c.running) / own, 0.0, 1.0));
            target = start + float(++c.pick) * part;
        }
        c.running += own;
    }
    prefix[place_of_prefix(row_of_running(), asker.index)] = c.running;
    prefix[place_of_prefix(row_of_picks(), asker.index)] = uintBitsToFloat(c.pick);
    keep_root(asker, w);
}
