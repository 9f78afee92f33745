// What virtual lights see of points, which stand for disks: a point an invocation, a map a row. A
// texel keeps the least key, in whatever order they come.
#include "kernel/imperfect_shadow.h"
#include "shared/bindings.h"
#include "shared/imperfect_shadows.h"

layout(local_size_x = 64) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_imperfect_args args; };
layout(std430, binding = BD_STORAGE_SHADOW_POINTS) readonly buffer point_block { vec4 points[]; };
layout(std430, binding = BD_STORAGE_SHADOW_CENTRES) readonly buffer centre_block { vec4 centres[]; };
layout(std430, binding = BD_STORAGE_SHADOW_TEXELS) buffer texel_block { uint texels[]; };

void keep(vec3 to, vec3 normal, float radius2, uint disk, uint map)
{
    float side = float(args.side);
    vec3 place = place_of_way(to);
    float reach = 0.5 * side * reach_of_disk(to, radius2, place.z) + 1.0;
    vec2 middle = vec2(texel_of_place(place.x, side), texel_of_place(place.y, side));
    uvec2 first = uvec2(clamp(middle - reach, 0.0, side)), end = uvec2(clamp(middle + reach + 1.0, 0.0, side));
    for (uint v = first.y; v < end.y; v++)
        for (uint u = first.x; u < end.x; u++) {
            vec3 way = way_of_place(place_of_texel(float(u) + 0.5, side), place_of_texel(float(v) + 0.5, side));
            uint key = key_of_disk(distance_to_disk(to, normal, radius2, way), disk);
            if (key != NO_DISK) atomicMin(texels[(map * args.side + v) * args.side + u], key);
        }
}

void main()
{
    uint disk = gl_GlobalInvocationID.x, map = args.first_map + gl_WorkGroupID.y;
    if (disk >= args.points) return;
    vec4 from = centres[map * BD_SHADOW_CENTRE_VEC4S], there = centres[map * BD_SHADOW_CENTRE_VEC4S + 1u];
    vec3 across = centres[map * BD_SHADOW_CENTRE_VEC4S + 2u].xyz, along = cross(there.xyz, across);
    uint point = uint(from.w) + disk;
    vec4 place = points[point * BD_SHADOW_POINT_VEC4S], normal = points[point * BD_SHADOW_POINT_VEC4S + 1u];
    vec3 to = in_axes(place.xyz - from.xyz, across, along, there.xyz);
    if (!(to.z > 0.0 && normal.w > 0.0 && there.w > 0.0)) return;
    keep(to, in_axes(normal.xyz, across, along, there.xyz), normal.w, disk, map);
}
