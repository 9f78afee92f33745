// Sums over the cut of a light's tree of what each node would give a receiver if nothing stood
// between them, on top of those of the lights before.
//
// BD_SPREAD: also how far off interpolated light may be (common/light_spread.glsl).
#include "common/tree_choice.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

float sum_so_far(uint place)
{
    if (tree_args.is_resumed != 0u) return prefix[place_of_prefix(light_of_walk(), place)];
    return light_of_walk() > 0u ? prefix[place_of_prefix(light_of_walk() - 1u, place)] : 0.0;
}

void main()
{
    asker_place asker = asker_place_at(gl_GlobalInvocationID.xy);
    if (!asker.exists) return;
    ivec2 pixel;
    receiver r = asker_receiver(asker, pixel);
    vec3 viewer = direction_to_viewer(r.relative_position);
    float sum = sum_so_far(asker.index), estimate = estimate_of(asker.index);
#ifdef BD_SPREAD
    light_spread spread = spread_of_block(asker.level, r, args.finest_level);
#endif
    walk w = walk_from(first_root(asker, r));
    cut_node c;
    while (w.at.root < w.end) {
        if (!takes_next(r, w, estimate, c)) continue;
        sum += node_strength(r, viewer, c.at, c.n, c.bounds);
#ifdef BD_SPREAD
        if (c.bounds.most > 0.0)
            add_spread(spread, r.normal_geometric, c.to_node, c.r2, vec4(c.n.normal, c.n.area),
                       all_channels(c.n.flux));
#endif
    }
    prefix[place_of_prefix(light_of_walk(), asker.index)] = sum;
#ifdef BD_SPREAD
    uint at = place_of_prefix(row_of_spread(), asker.index);
    bool first = light_of_walk() == 0u && tree_args.is_resumed == 0u;
    prefix[at] = spread.sum + (first ? 0.0 : prefix[at]);
#endif
    keep_root(asker, w);
}
