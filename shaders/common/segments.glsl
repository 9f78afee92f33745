// Segments between receivers and VPLs, for who asks what lies between them (shared/rays.h).
//
// A segment starts on the receiver and ends on the surface that the VPL stands for: at its
// representative texel, since a mean of texels may lie within a curved wall. Both ends are lifted
// off their surfaces by what a position loses on its way through G-buffer and map, so that
// neighbours in the same plane do not hide them.
#include "common/asker.glsl"
#include "common/vpl_gather.glsl"
#include "shared/rays.h"
#ifdef BD_FRAGMENTS
#include "common/block_receiver.glsl"
#endif

layout(binding = BD_UNIT_GBUFFER_TRIANGLE) uniform usampler2D gbuffer_triangle;
layout(std430, binding = BD_STORAGE_SEGMENTS) writeonly buffer segment_block { uvec4 segments[]; };

const float LIFT = 3.8e-6;       // times the largest coordinate
const float LIFT_LEAST = 4.8e-7; // where all are small: lights and eyes are not

float largest(vec3 v) { return max(abs(v.x), max(abs(v.y), abs(v.z))); }

void store_segment(uint index, vec3 from, uint from_triangle, vec3 to)
{
    segments[index * BD_SEGMENT_UVEC4S] = uvec4(floatBitsToUint(from), from_triangle);
    segments[index * BD_SEGMENT_UVEC4S + 1u] = uvec4(floatBitsToUint(to), BD_NO_TRIANGLE);
}

// One that asks nothing.
void store_no_segment(uint index) { store_segment(index, vec3(0.0), BD_NO_TRIANGLE, vec3(0.0)); }

// What is lit, and a pixel on its surface: a block's receiver lies between pixels, on a curved
// surface off it, so that rays start from the pixel.
receiver asker_receiver(asker_place place, out ivec2 pixel)
{
#ifdef BD_FRAGMENTS
    receiver r = block_receiver(place.level, place.block, pixel);
#else
    pixel = place.block;
    receiver r = gbuffer_receiver(pixel);
#endif
    r.lit = is_asked(r);
    return r;
}

// Where a receiver's rays start, and which triangle that is on.
struct ray_start {
    receiver at;
    uint triangle;
};

ray_start ray_start_at(ivec2 pixel)
{
    return ray_start(gbuffer_receiver(pixel), texelFetch(gbuffer_triangle, pixel, 0).x - 1u);
}

void store_segment_to(uint index, ray_start start, uint vpl)
{
    receiver r = start.at;
    vec4 u = BD_LOAD(vpl_quads, vpl * BD_VPL_QUAD_VEC4S);
    vec4 v = BD_LOAD(vpl_quads, vpl * BD_VPL_QUAD_VEC4S + 1u);
    vec3 position = BD_LOAD(vpls, vpl * BD_VPL_VEC4S).xyz;
    vec3 normal = BD_LOAD(vpls, vpl * BD_VPL_VEC4S + 1u).xyz;
    float along_u = BD_LOAD(vpls, vpl * BD_VPL_VEC4S + 2u).w;
    vec3 to = position - u.xyz * along_u - v.xyz * v.w;
    float lift = LIFT * max(largest(view.position.xyz), max(largest(r.position), largest(to)));
    lift += LIFT_LEAST;
    store_segment(index, r.position + r.normal_geometric * lift, start.triangle, to + normal * lift);
}

// Whether the receiver would have light of it if nothing stood between them.
bool is_reached(receiver r, virtual_light vpl)
{
    vec3 to_vpl = vpl.position_area.xyz - r.position, normal = vpl.normal_near.xyz;
    float r2 = dot(to_vpl, to_vpl);
    bool reached = disk_seen(r, to_vpl, r2, normal, vpl.position_area.w) > 0.0;
#ifdef BD_VPL_PATCH
    bool near = r2 < vpl.normal_near.w && faces(normal, to_vpl, r2);
    reached = near ? is_above(dot(to_vpl, r.normal_geometric), r2) : reached;
#endif
    return r.lit && reached && vpl.flux != vec3(0.0);
}
