// Sums over groups of VPLs of what each would give a receiver if nothing stood between them: running
// sums, from the first VPL of the list on. Slices of the list follow one another.
//
// BD_GROUPED: groups that are far count as one VPL each.
// BD_SPREAD: behind those, how far off interpolated light may be (common/light_spread.glsl).
#include "common/vpl_walk.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

#ifdef BD_SPREAD
void weigh_spread(inout light_spread spread, receiver r, virtual_light vpl)
{
    vec3 to_vpl = vpl.position_area.xyz - r.position;
    add_spread(spread, r.normal_geometric, to_vpl, dot(to_vpl, to_vpl),
               vec4(vpl.normal_near.xyz, vpl.position_area.w), all_channels(vpl.flux));
}

void keep_spread(light_spread spread, uint place)
{
    uint at = place_of_prefix(args.running_sum_count, place);
    prefix[at] = spread.sum + (args.first_item > 0u ? prefix[at] : 0.0);
}
#endif

void main()
{
    asker_place asker = asker_place_at(gl_GlobalInvocationID.xy);
    if (!asker.exists) return;
    ivec2 pixel;
    receiver r = asker_receiver(asker, pixel);
    uint place = asker.index;
    vec3 viewer = direction_to_viewer(r.relative_position);
    uint group = args.first_item / args.vpls_per_group, end = args.first_item + (r.lit ? args.item_count : 0u);
#ifdef BD_SPREAD
    light_spread spread = spread_of_block(asker.level, r, args.finest_level);
#endif
    float sum = group > 0u ? prefix[place_of_prefix(group - 1u, place)] : 0.0;
    for (uint begin = args.first_item; begin < end; begin += args.vpls_per_group, group++) {
        uint group_end = min(begin + args.vpls_per_group, end);
        float part = 0.0;
#ifdef BD_GROUPED
        vpl_group whole = group_of(r, group);
        part = whole.is_near ? 0.0 : strength(r, whole);
#ifdef BD_SPREAD
        if (!whole.is_near)
            add_spread(spread, r.normal_geometric, whole.to, whole.r2, vec4(whole.normal, whole.area), whole.flux);
#endif
        group_end = whole.is_near ? group_end : begin;
#endif
        for (uint index = begin; index < group_end; index++) {
            virtual_light vpl = vpl_at(index);
            part += strength(r, viewer, vpl);
#ifdef BD_SPREAD
            weigh_spread(spread, r, vpl);
#endif
        }
        sum += part;
        prefix[place_of_prefix(group, place)] = sum;
    }
#ifdef BD_SPREAD
    keep_spread(spread, place);
#endif
}
