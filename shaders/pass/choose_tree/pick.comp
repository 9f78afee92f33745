// For nodes that a receiver chose, of one light: the leaf that stands for each, chosen in proportion
// to what it and its parents would give, the segment to it, and the node's light.
#include "common/tree_choice.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

place place_of_pick(uvec4 pick)
{
    return place(pick.x, pick.y >> 28u, pick.y & 0xfffffffu);
}

float child_strength(receiver r, vec3 viewer, place at)
{
    tree_node n = load_node(at);
    tree_bounds bounds = bounds_of(n, r.position, r.normal, r.normal_geometric);
    return node_strength(r, viewer, at, n, bounds);
}

place sibling(place at, uint i) { return place(at.root, at.level, at.morton + i); }

// `into` in [0, 1]: how far into the node, whose leaves are in order.
place leaf_below(receiver r, vec3 viewer, place at, float into)
{
    while (is_inner(at.level)) {
        at = child(at);
        vec4 own = vec4(child_strength(r, viewer, at), child_strength(r, viewer, sibling(at, 1u)),
                        child_strength(r, viewer, sibling(at, 2u)),
                        child_strength(r, viewer, sibling(at, 3u)));
        // Where none gives anything by itself, though they did together, any will do.
        if (!(own.x + own.y + own.z + own.w > 0.0)) own = vec4(1.0);
        float target = into * (own.x + own.y + own.z + own.w), before = 0.0, taken = own.x;
        uint chosen = 0u;
        if (target >= before + taken && own.y + own.z + own.w > 0.0) {
            before += own.x, taken = own.y, chosen = 1u;
            if (target >= before + taken && own.z + own.w > 0.0) {
                before += own.y, taken = own.z, chosen = 2u;
                if (target >= before + taken && own.w > 0.0)
                    before += own.z, taken = own.w, chosen = 3u;
            }
        }
        at = sibling(at, chosen);
        into = taken > 0.0 ? clamp((target - before) / taken, 0.0, 1.0) : 0.5;
    }
    return at;
}

void store_light(uint index, receiver r, sums light, float stands_for)
{
    picks[index * BD_PICK_VEC4S] = floatBitsToUint(vec4(light.diffuse * stands_for, 0.0));
#ifdef BD_VECTOR
    vec3 vector = irradiance_vector(light, r.normal) * stands_for;
    picks[index * BD_PICK_VEC4S + 1u] = floatBitsToUint(vec4(vector, 0.0));
#endif
}

// What one part of the sum is, over what the node gives.
float stands_for(asker_place asker, uvec4 pick)
{
    float total = prefix[place_of_prefix(light_count() - 1u, asker.index)];
    return total / float(args.rays_per_receiver) / uintBitsToFloat(pick.z);
}

// True for a leaf that must be integrated as a patch, which is left to be done.
bool find(asker_place asker, receiver r, vec3 viewer, ray_start start, uint index, uvec4 pick)
{
    sums light = no_light();
    if (pick.x == NO_ROOT) {
        store_no_segment(index);
        store_light(index, r, light, 0.0);
        return false;
    }
    place at = place_of_pick(pick);
    tree_node n = load_node(at);
    vec3 to_node = n.position - r.position;
    tree_bounds bounds = bounds_of(n, r.position, r.normal, r.normal_geometric);
    cut_node c = cut_node(at, n, bounds, to_node, dot(to_node, to_node));
    float into = uintBitsToFloat(picks[index * BD_PICK_VEC4S + 1u].x);
    store_segment_to(index, start, leaf_index(leaf_below(r, viewer, at, into)));
#ifdef BD_VPL_PATCH
    if (is_near(c)) return true;
#endif
    node_light l = light_of(r, n, at.level, bounds.most);
    add(light, r, viewer, l.direction, dot(l.direction, l.direction), l.irradiance);
    store_light(index, r, light, stands_for(asker, pick));
    return false;
}

#ifdef BD_VPL_PATCH
void integrate(asker_place asker, receiver r, vec3 viewer, uint index)
{
    uvec4 pick = picks[index * BD_PICK_VEC4S];
    sums light = no_light();
    add_patch(light, r, viewer, leaf_index(place_of_pick(pick)));
    store_light(index, r, light, stands_for(asker, pick));
}
#endif

void main()
{
    asker_place asker = asker_place_at(gl_GlobalInvocationID.xy);
    if (!asker.exists) return;
    ivec2 pixel;
    receiver r = asker_receiver(asker, pixel);
    vec3 viewer = direction_to_viewer(r.relative_position);
    ray_start start = ray_start_at(pixel);
    uint first = asker.index * args.rays_per_receiver, rays_end = args.first_item + args.item_count;
    for (uint ray = args.first_item; ray < rays_end; ray += 32u) {
        uint near = 0u, end = min(ray + 32u, rays_end);
        for (uint i = ray; i < end; i++) {
            uvec4 pick = picks[(first + i) * BD_PICK_VEC4S];
            if (pick.w != light_of_walk() + 1u) continue;
            if (find(asker, r, viewer, start, first + i, pick)) near |= 1u << (i - ray);
        }
#ifdef BD_VPL_PATCH
        while (near != 0u) {
            integrate(asker, r, viewer, first + ray + uint(findLSB(near)));
            near &= near - 1u;
        }
#endif
    }
}
