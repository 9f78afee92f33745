// VPLs for a receiver in proportion to what they would give it, by systematic sampling over the
// running sums (common/systematic.glsl).
#include "common/systematic.glsl"
#include "common/vpl_walk.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = BD_STORAGE_PICKS) writeonly buffer pick_block { vec4 picks[]; };

// The first group whose running sum is more than `target`; the last where none is.
uint group_at(float target, uint place)
{
    uint low = 0u, high = args.running_sum_count - 1u;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (prefix[place_of_prefix(middle, place)] > target)
            high = middle;
        else
            low = middle + 1u;
    }
    return low;
}

const uint NO_VPL = 0xffffffffu;

// The first VPL at which the running sum is more than `target`, and its own part of that; by
// rounding there may be none, and then it is the last of the group that gives anything.
uint vpl_at_target(receiver r, vec3 viewer, float target, uint place, out float own)
{
    uint group = group_at(target, place);
    float sum = group > 0u ? prefix[place_of_prefix(group - 1u, place)] : 0.0;
    uint begin = group * args.vpls_per_group, found = NO_VPL;
    uint end = min(begin + args.vpls_per_group, args.list_vpl_count);
#ifdef BD_GROUPED
    // What the group counted as stands for what its VPLs give.
    float counted = prefix[place_of_prefix(group, place)] - sum, given = 0.0;
    for (uint index = begin; index < end; index++) given += strength(r, viewer, vpl_at(index));
    float of_given = counted > 0.0 ? given / counted : 0.0;
    target = (target - sum) * of_given;
    sum = 0.0;
#endif
    own = 0.0;
    for (uint index = begin; index < end; index++) {
        float part = strength(r, viewer, vpl_at(index));
        bool takes = part > 0.0 && !(sum > target);
        found = takes ? index : found;
        own = takes ? part : own;
        sum += part;
    }
#ifdef BD_GROUPED
    own = of_given > 0.0 ? own / of_given : 0.0;
    found = own > 0.0 ? found : NO_VPL;
#endif
    return found;
}

void store_pick(uint index, receiver r, sums light, float stands_for)
{
    picks[index * BD_PICK_VEC4S] = vec4(light.diffuse * stands_for, 0.0);
#ifdef BD_GLOSSY
    picks[index * BD_PICK_VEC4S + 1u] = vec4(light.glossy * stands_for, 0.0);
#endif
#ifdef BD_VECTOR
    picks[index * BD_PICK_VEC4S + 1u] = vec4(irradiance_vector(light, r.normal) * stands_for, 0.0);
#endif
}

// What a receiver chooses by.
struct choice {
    receiver r;
    vec3 viewer;
    float total, first_target;
    uint place;
};

// One ray's VPL. True where it must be integrated as a patch, which is left to be done.
bool choose_one(choice c, ray_start start, uint ray, uint index)
{
    float own, part = c.total / float(args.rays_per_receiver);
    uint vpl = vpl_at_target(c.r, c.viewer, c.first_target + float(ray) * part, c.place, own);
    sums light = no_light();
    if (!c.r.lit || vpl == NO_VPL) {
        store_no_segment(index);
        store_pick(index, c.r, light, 0.0);
        return false;
    }
    bool far = add_far(light, c.r, c.viewer, vpl_with_coat(c.r, vpl));
    store_segment_to(index, start, vpl);
    store_pick(index, c.r, light, part / own);
    return !far;
}

#ifdef BD_VPL_PATCH
void choose_near(choice c, uint ray, uint index)
{
    float own, part = c.total / float(args.rays_per_receiver);
    uint vpl = vpl_at_target(c.r, c.viewer, c.first_target + float(ray) * part, c.place, own);
    sums light = no_light();
    add_patch(light, c.r, c.viewer, vpl);
    store_pick(index, c.r, light, part / own);
}
#endif

void main()
{
    asker_place asker = asker_place_at(gl_GlobalInvocationID.xy);
    if (!asker.exists) return;
    ivec2 pixel;
    receiver r = asker_receiver(asker, pixel);
    float total = r.lit ? prefix[place_of_prefix(args.running_sum_count - 1u, asker.index)] : 0.0;
    float first_target = place_in_part(uvec2(asker.block)) * total / float(args.rays_per_receiver);
    choice c = choice(r, direction_to_viewer(r.relative_position), total, first_target, asker.index);
    ray_start start = ray_start_at(pixel);
    uint first = asker.index * args.rays_per_receiver;
    uint rays_end = args.first_item + args.item_count;
    for (uint ray = args.first_item; ray < rays_end; ray += 32u) {
        uint near = 0u, end = min(ray + 32u, rays_end);
        for (uint i = ray; i < end; i++)
            if (choose_one(c, start, i, first + i)) near |= 1u << (i - ray);
#ifdef BD_VPL_PATCH
        while (near != 0u) {
            uint i = ray + uint(findLSB(near));
            choose_near(c, i, first + i);
            near &= near - 1u;
        }
#endif
    }
}
