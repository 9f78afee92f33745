// Segments between receivers and VPLs, for who asks what lies between them (shared/rays.h).
//
// A segment starts on the receiver and ends on the surface that the VPL stands for.
#include "common/vpl_gather.glsl"
#include "kernel/choice.h"
#include "common/ray_start.glsl"
#include "shared/rays.h"
#include "common/asker_receiver.glsl" // last: what it includes and others do is above

layout(binding = BD_UNIT_GBUFFER_TRIANGLE) uniform usampler2D gbuffer_triangle;
layout(std430, binding = BD_STORAGE_SEGMENTS) writeonly buffer segment_block { uvec4 segments[]; };

void store_segment(uint index, vec3 from, uint from_triangle, vec3 to, uint map)
{
    segments[index * BD_SEGMENT_UVEC4S] = uvec4(floatBitsToUint(from), from_triangle);
    segments[index * BD_SEGMENT_UVEC4S + 1u] = uvec4(floatBitsToUint(to), map);
}

// One that asks nothing.
void store_no_segment(uint index)
{
    store_segment(index, vec3(0.0), BD_NO_TRIANGLE, vec3(0.0), BD_NO_TRIANGLE);
}

// Where maps are asked.
uint map_of_vpl(uint vpl)
{
    return args.vpls_per_map == 0u ? BD_NO_TRIANGLE : args.first_map + vpl / args.vpls_per_map;
}

// Where a receiver's rays start, and which triangle that is on.
struct ray_start {
    receiver at;
    uint triangle;
};

ray_start ray_start_at(ivec2 pixel)
{
    return ray_start(ray_receiver(pixel), texelFetch(gbuffer_triangle, pixel, 0).x - 1u);
}

void store_segment_to(uint index, ray_start start, uint vpl)
{
    receiver r = start.at;
    vec4 u = BD_LOAD(vpl_quads, vpl * BD_VPL_QUAD_VEC4S);
    vec4 v = BD_LOAD(vpl_quads, vpl * BD_VPL_QUAD_VEC4S + 1u);
    vec3 position = BD_LOAD(vpls, vpl * BD_VPL_VEC4S).xyz;
    vec3 normal = BD_LOAD(vpls, vpl * BD_VPL_VEC4S + 1u).xyz;
    float along_u = BD_LOAD(vpls, vpl * BD_VPL_VEC4S + 2u).w;
    vec3 to = end_of_segment(position, u.xyz, v.xyz, u.w, along_u, v.w);
    float lift = lift_of_segment(largest_coordinate(view.position.xyz), r.position, to);
    vec3 from = r.position + r.normal_geometric * lift;
    uint map = map_of_vpl(vpl);
    store_segment(index, from, start.triangle,
                  map == BD_NO_TRIANGLE ? to + normal * lift : r.normal_geometric, map);
}

// Whether the receiver would have light of it if nothing stood between them.
bool is_reached(receiver r, virtual_light vpl)
{
    vec3 to_vpl = vpl.position_area.xyz - r.position, normal = vpl.normal_near.xyz;
    float r2 = dot(to_vpl, to_vpl);
    bool reached = disk_seen(r, to_vpl, r2, normal, vpl.position_area.w, VPL_UNBOUNDED) > 0.0;
#ifdef BD_VPL_PATCH
    bool near = r2 < vpl.normal_near.w && faces(normal, to_vpl, r2);
    reached = near ? is_above(dot(to_vpl, r.normal_geometric), r2) : reached;
#endif
    return r.lit && reached && vpl.flux != vec3(0.0);
}
