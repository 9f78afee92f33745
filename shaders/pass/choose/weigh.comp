// Sums over groups of VPLs of what each would give a pixel if nothing stood between them: running
// sums, from the first VPL of the list on. Slices of the list follow one another.
#include "common/vpl_walk.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_choose_args args; };

void main()
{
    uvec2 at = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(at, args.tile.zw))) return;
    ivec2 pixel = ivec2(at + args.tile.xy);
    uint place = at.y * args.tile.z + at.x, receivers = args.tile.z * args.tile.w;
    receiver r = gbuffer_receiver(pixel);
    vec3 viewer = direction_to_viewer(r.relative_position);
    uint group = args.vpls.x / args.vpls.z, end = args.vpls.x + args.vpls.y;
    float sum = group > 0u ? prefix[place_of_prefix(group - 1u, receivers, place)] : 0.0;
    for (uint begin = args.vpls.x; begin < end; begin += args.vpls.z, group++) {
        uint group_end = min(begin + args.vpls.z, end);
        for (uint index = begin; index < group_end; index++) sum += strength(r, viewer, vpl_at(index));
        prefix[place_of_prefix(group, receivers, place)] = sum;
    }
}
