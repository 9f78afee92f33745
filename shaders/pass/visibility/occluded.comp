// Which segments something lies across: a segment an invocation, answered as rays/trace.c does.
//
// Triangles are tested as Embree's robust mode does, by the signs of the segment's Pluecker products
// with their edges: an edge gives its two triangles the same number with opposite signs, so nothing
// passes between them. Nodes and triangles are as shared/rays.h has them.
//
// A walk may be long: the software device ends the loops of eight invocations after 65,535 rounds
// in all, and others have a watchdog. So it keeps where it is, and another dispatch goes on.
//
// Shoemake 1998 (Pluecker coordinates); Aila, Laine 2009 (finding a leaf, then its triangles).
#include "shared/bindings.h"
#include "shared/rays.h"

layout(local_size_x = 64) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_occluded_args args; };
layout(std430, binding = BD_STORAGE_SEGMENTS) readonly buffer segment_block { uvec4 segments[]; };
layout(std430, binding = BD_STORAGE_OCCLUDED) buffer occluded_block { uint occluded[]; };
layout(std430, binding = BD_STORAGE_RAY_NODES) readonly buffer node_block { uvec4 nodes[]; };
layout(std430, binding = BD_STORAGE_RAY_TRIANGLES) readonly buffer triangle_block { uvec4 triangles[]; };
layout(std430, binding = BD_STORAGE_RAY_PLACES) buffer place_block { uint places[]; };
layout(std430, binding = BD_STORAGE_RAY_COUNTS) buffer count_block { uint counts[]; };

#ifdef BD_CUTOUT
#include "common/ray_cutout.glsl"
#endif

shared uint group_bits[2];
shared uint group_counts[BD_RAY_COUNTS];

const uint REACH_BITS = 0x5dccb9a2u; // of 1.844e18
const uint INFINITY_BITS = 0x7f800000u;
const float ULP = 1.1920929e-7;
const float DIRECTION_LEAST = 1e-18;    // whose inverse is taken
const float BOX_SLACK = 1.9073486e-6;   // sixteen units in the last place

struct segment {
    vec3 from, along, per_along;
    float near, far;
    uvec2 excluded;
};

// Of their bits, since comparisons of what is no number are nobody's promise.
bool is_within_reach(vec3 v)
{
    return all(lessThanEqual(floatBitsToUint(v) & 0x7fffffffu, uvec3(REACH_BITS)));
}

bool differ(uint a, uint b)
{
    uvec2 sizes = uvec2(a, b) & 0x7fffffffu;
    bool is_number = max(sizes.x, sizes.y) <= INFINITY_BITS;
    return !is_number || (a != b && (sizes.x | sizes.y) != 0u);
}

bool has_length(uvec3 from, uvec3 to)
{
    return differ(from.x, to.x) || differ(from.y, to.y) || differ(from.z, to.z);
}

float largest(vec3 v) { return max(abs(v.x), max(abs(v.y), abs(v.z))); }

vec3 inverse_of(vec3 v)
{
    vec3 least = mix(vec3(DIRECTION_LEAST), vec3(-DIRECTION_LEAST), lessThan(v, vec3(0.0)));
    return 1.0 / mix(v, least, lessThan(abs(v), vec3(DIRECTION_LEAST)));
}

// False for one that nothing can lie across.
bool make_segment(uvec4 from, uvec4 to, out segment s)
{
    s.from = uintBitsToFloat(from.xyz);
    vec3 end = uintBitsToFloat(to.xyz);
    precise vec3 along = end - s.from;
    s.along = along;
    s.excluded = uvec2(from.w, to.w);
    if (!is_within_reach(s.from) || !is_within_reach(s.along)) return false;
    precise float bias = BD_RAY_BIAS * max(largest(s.from), largest(end)) / length(s.along);
    precise float far = 1.0 - bias;
    s.near = bias;
    s.far = far;
    s.per_along = inverse_of(s.along);
    return s.near < s.far;
}

bool meets_box(segment s, vec3 least, vec3 most)
{
    vec3 a = (least - s.from) * s.per_along, b = (most - s.from) * s.per_along;
    vec3 enters = min(a, b), leaves = max(a, b);
    float enter = max(max(enters.x, enters.y), enters.z);
    float leave = min(min(leaves.x, leaves.y), leaves.z);
    return max(enter, s.near * (1.0 - BOX_SLACK)) <= min(leave, s.far) * (1.0 + BOX_SLACK);
}

vec3 cross_exactly(vec3 a, vec3 b)
{
    precise vec3 left = a.yzx * b.zxy, right = a.zxy * b.yzx;
    precise vec3 difference = left - right;
    return difference;
}

float dot_exactly(vec3 a, vec3 b)
{
    precise vec3 parts = a * b;
    precise float sum = parts.x + parts.y + parts.z;
    return sum;
}

// Whichever of two edges' products loses less, axis by axis.
vec3 normal_of(vec3 a, vec3 b, vec3 c)
{
    bvec3 first = lessThan(abs(a.zxy * b.yzx), abs(b.zxy * c.yzx));
    return mix(cross_exactly(b, c), cross_exactly(a, b), first);
}

// `at`: barycentrics of its second and third corner, for one that is met.
bool meets_triangle(segment s, vec3 a, vec3 b, vec3 c, out vec2 at)
{
    precise vec3 p = a - s.from, q = b - s.from, r = c - s.from;
    precise vec3 rp = r - p, pq = p - q, qr = q - r;
    precise vec3 around_rp = r + p, around_pq = p + q, around_qr = q + r;
    float u = dot_exactly(cross_exactly(rp, around_rp), s.along);
    float v = dot_exactly(cross_exactly(pq, around_pq), s.along);
    float w = dot_exactly(cross_exactly(qr, around_qr), s.along);
    precise float sum = u + v + w;
    float slack = ULP * abs(sum);
    at = vec2(0.0);
    bool is_within = min(min(u, v), w) >= -slack || max(max(u, v), w) <= slack;
    if (!is_within) return false;
    vec3 normal = normal_of(rp, pq, qr);
    float facing = dot_exactly(normal, s.along);
    precise float distance = dot_exactly(p, normal) / facing;
    at = min(vec2(u, v) / sum, 1.0);
    return facing != 0.0 && s.near <= distance && distance <= s.far;
}

bool meets_one_of(segment s, uint leaf)
{
    uint first = leaf / BD_RAY_LEAF_COUNTS, end = first + leaf % BD_RAY_LEAF_COUNTS;
    bool meets = false;
    for (uint t = first; t < end && !meets; t++) {
        uvec4 a = triangles[t * BD_RAY_TRIANGLE_UVEC4S];
        uvec4 b = triangles[t * BD_RAY_TRIANGLE_UVEC4S + 1u];
        uvec4 c = triangles[t * BD_RAY_TRIANGLE_UVEC4S + 2u];
        vec2 place;
        meets = a.w != s.excluded.x && a.w != s.excluded.y &&
                meets_triangle(s, uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz), uintBitsToFloat(c.xyz),
                               place);
#ifdef BD_CUTOUT
        if (meets && b.w != 0u) meets = is_there(b.w - 1u, a.w, s.from, s.along, place);
#endif
    }
    return meets;
}

// Goes on from a node; leaves the node that is next, or behind the last. True: something is met.
bool walk(segment s, inout uint at)
{
    uint looks = 0u;
    bool meets = false;
    while (at < args.slice.z && looks < args.slice.w && !meets) {
        uint leaf = 0u;
        while (at < args.slice.z && looks < args.slice.w && leaf == 0u) {
            uvec4 low = nodes[at * BD_RAY_NODE_UVEC4S], high = nodes[at * BD_RAY_NODE_UVEC4S + 1u];
            bool is_met = meets_box(s, uintBitsToFloat(low.xyz), uintBitsToFloat(high.xyz));
            leaf = is_met ? high.w : 0u;
            at = is_met ? at + 1u : low.w;
            looks++;
        }
        if (leaf != 0u) meets = meets_one_of(s, leaf);
        looks += leaf % BD_RAY_LEAF_COUNTS + 1u;
    }
    return meets;
}

bool answer(uint index)
{
    uvec4 from = segments[index * BD_SEGMENT_UVEC4S], to = segments[index * BD_SEGMENT_UVEC4S + 1u];
    bool begins = args.walk.x == 1u;
    uint at = begins ? 0u : places[index];
    bool is_asked = has_length(from.xyz, to.xyz);
    if (begins && is_asked) atomicAdd(group_counts[BD_RAY_COUNT_ASKED], 1u);
    segment s;
    bool can_be_met = make_segment(from, to, s) && is_asked;
    bool is_met = can_be_met && walk(s, at);
    bool is_finished = !can_be_met || is_met || at >= args.slice.z;
    if (!is_finished) atomicAdd(group_counts[BD_RAY_COUNT_UNFINISHED], 1u);
    places[index] = is_finished ? args.slice.z : at;
    return is_met;
}

void main()
{
    uint index = args.slice.x + gl_GlobalInvocationID.x, place = gl_LocalInvocationID.x;
    if (place < 2u) group_bits[place] = group_counts[place] = 0u;
    barrier();
    if (index < args.slice.y && answer(index)) atomicOr(group_bits[place / 32u], 1u << place % 32u);
    barrier();
    if (place < 2u && group_counts[place] != 0u) atomicAdd(counts[place], group_counts[place]);
    if (index >= args.slice.y || place % 32u != 0u) return;
    uint bits = group_bits[place / 32u];
    occluded[index / 32u] = args.walk.x == 1u ? bits : occluded[index / 32u] | bits;
}
