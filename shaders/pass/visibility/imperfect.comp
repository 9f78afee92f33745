// Which segments end where imperfect shadow maps say that nothing is seen: a segment an invocation.
#include "kernel/imperfect_shadow.h"
#include "shared/bindings.h"
#include "shared/imperfect_shadows.h"
#include "shared/rays.h"

layout(local_size_x = 64) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_imperfect_args args; };
layout(std430, binding = BD_STORAGE_SHADOW_POINTS) readonly buffer point_block { vec4 points[]; };
layout(std430, binding = BD_STORAGE_SHADOW_CENTRES) readonly buffer centre_block { vec4 centres[]; };
layout(std430, binding = BD_STORAGE_SHADOW_TEXELS) readonly buffer texel_block { uint texels[]; };
layout(std430, binding = BD_STORAGE_SEGMENTS) readonly buffer segment_block { uvec4 segments[]; };
layout(std430, binding = BD_STORAGE_OCCLUDED) writeonly buffer occluded_block { uint occluded[]; };

shared uint group_bits[2];

const int NOTHING = -1;

// What a texel says: 1, 0, or NOTHING where no disk is there.
int say(vec4 centre, uint map, uvec2 at, vec3 to, vec3 receiver_normal)
{
    uint key = texels[(map * args.side + at.y) * args.side + at.x];
    if (key == NO_DISK) return NOTHING;
    uint point = uint(centre.w) + (key & DISKS_MOST);
    vec3 disk = points[point * BD_SHADOW_POINT_VEC4S].xyz - centre.xyz;
    vec4 normal = points[point * BD_SHADOW_POINT_VEC4S + 1u];
    return hides(disk, normal.xyz, normal.w, to, receiver_normal, args.bias) ? 1 : 0;
}

// What most of the four beside it say.
bool say_around(vec4 centre, uint map, uvec2 at, vec3 to, vec3 receiver_normal)
{
    int hidden = 0, asked = 0;
    for (uint i = 1u; i < 9u; i += 2u) {
        uvec2 next = at + uvec2(i % 3u, i / 3u) - 1u;
        if (next.x >= args.side || next.y >= args.side) continue;
        int said = say(centre, map, next, to, receiver_normal);
        asked += said >= 0 ? 1 : 0;
        hidden += said > 0 ? 1 : 0;
    }
    return 2 * hidden > asked;
}

bool is_hidden(uint index)
{
    uvec4 from = segments[index * BD_SEGMENT_UVEC4S];
    uvec4 end = segments[index * BD_SEGMENT_UVEC4S + 1u];
    uint map = end.w;
    if (map == BD_NO_TRIANGLE) return false;
    vec3 receiver_normal = uintBitsToFloat(end.xyz);
    vec4 centre = centres[map * BD_SHADOW_CENTRE_VEC4S];
    vec3 normal = centres[map * BD_SHADOW_CENTRE_VEC4S + 1u].xyz;
    vec3 across = centres[map * BD_SHADOW_CENTRE_VEC4S + 2u].xyz;
    vec3 to = uintBitsToFloat(from.xyz) - centre.xyz;
    vec3 way = in_axes(to, across, cross(normal, across), normal);
    if (!(way.z > 0.0)) return false;
    vec3 place = place_of_way(way);
    float side = float(args.side);
    vec2 texel = vec2(texel_of_place(place.x, side), texel_of_place(place.y, side));
    uvec2 at = uvec2(clamp(texel, 0.0, side - 1.0));
    int said = say(centre, map, at, to, receiver_normal);
    return said == NOTHING && args.fills == 1u ? say_around(centre, map, at, to, receiver_normal) : said > 0;
}

void main()
{
    uint index = args.first_segment + gl_GlobalInvocationID.x, place = gl_LocalInvocationID.x;
    if (place < 2u) group_bits[place] = 0u;
    barrier();
    if (index < args.end_segment && is_hidden(index)) atomicOr(group_bits[place / 32u], 1u << place % 32u);
    barrier();
    if (index < args.end_segment && place % 32u == 0u) occluded[index / 32u] = group_bits[place / 32u];
}
