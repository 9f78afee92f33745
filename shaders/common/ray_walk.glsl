// A walk through the triangles of a snapshot: a line an invocation, whatever is asked about it.
// Answers are those of rays/trace.c. A program that includes this declares `args`, a
// bd_ray_walk_args, and says what ends a line at a triangle (ends_at).
//
// Triangles are tested as Embree's robust mode does, by the signs of the line's Pluecker products
// with their edges: an edge gives its two triangles the same number with opposite signs, so nothing
// passes between them. Nodes and triangles are as shared/rays.h has them.
//
// A walk may be long: the software device ends the loops of eight invocations after 65,535 rounds
// in all, and others have a watchdog. So it keeps where it is, and another dispatch goes on.
//
// Shoemake 1998 (Pluecker coordinates); Aila, Laine 2009 (finding a leaf, then its triangles).
layout(std430, binding = BD_STORAGE_RAY_NODES) readonly buffer node_block { uvec4 nodes[]; };
layout(std430, binding = BD_STORAGE_RAY_TRIANGLES) readonly buffer triangle_block { uvec4 triangles[]; };
layout(std430, binding = BD_STORAGE_RAY_PLACES) buffer place_block { uint places[]; };
layout(std430, binding = BD_STORAGE_RAY_COUNTS) buffer count_block { uint counts[]; };

#ifdef BD_CUTOUT
#include "common/ray_cutout.glsl"
#endif

shared uint group_counts[BD_RAY_COUNTS];

const uint REACH_BITS = 0x5dccb9a2u; // of 1.844e18
const uint INFINITY_BITS = 0x7f800000u;
const float ULP = 1.1920929e-7;
const float DIRECTION_LEAST = 1e-18;    // whose inverse is taken
const float BOX_SLACK = 1.9073486e-6;   // sixteen units in the last place

struct line {
    vec3 from, along, per_along;
    float near, far;
    uvec2 excluded; // triangles
};

// A triangle that a line comes to.
struct meeting {
    uint number, cutout, back;
    float distance; // in lengths of the line
    vec2 at;        // barycentrics of the second and third corner
    bool is_along;  // its corners' normal
};

// Whether the line ends there: `far` may be drawn nearer instead.
bool ends_at(inout line l, meeting m);

// Of their bits, since comparisons of what is no number are nobody's promise.
bool is_within_reach(vec3 v)
{
    return all(lessThanEqual(floatBitsToUint(v) & 0x7fffffffu, uvec3(REACH_BITS)));
}

float largest(vec3 v) { return max(abs(v.x), max(abs(v.y), abs(v.z))); }

vec3 inverse_of(vec3 v)
{
    vec3 least = mix(vec3(DIRECTION_LEAST), vec3(-DIRECTION_LEAST), lessThan(v, vec3(0.0)));
    return 1.0 / mix(v, least, lessThan(abs(v), vec3(DIRECTION_LEAST)));
}

bool intersects_box(line l, vec3 least, vec3 most)
{
    vec3 a = (least - l.from) * l.per_along, b = (most - l.from) * l.per_along;
    vec3 enters = min(a, b), leaves = max(a, b);
    float enter = max(max(enters.x, enters.y), enters.z);
    float leave = min(min(leaves.x, leaves.y), leaves.z);
    return max(enter, l.near * (1.0 - BOX_SLACK)) <= min(leave, l.far) * (1.0 + BOX_SLACK);
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

bool intersects_triangle(line l, vec3 a, vec3 b, vec3 c, inout meeting m)
{
    precise vec3 p = a - l.from, q = b - l.from, r = c - l.from;
    precise vec3 rp = r - p, pq = p - q, qr = q - r;
    precise vec3 around_rp = r + p, around_pq = p + q, around_qr = q + r;
    float u = dot_exactly(cross_exactly(rp, around_rp), l.along);
    float v = dot_exactly(cross_exactly(pq, around_pq), l.along);
    float w = dot_exactly(cross_exactly(qr, around_qr), l.along);
    precise float sum = u + v + w;
    float slack = ULP * abs(sum);
    bool is_within = min(min(u, v), w) >= -slack || max(max(u, v), w) <= slack;
    if (!is_within) return false;
    vec3 normal = normal_of(rp, pq, qr);
    float facing = dot_exactly(normal, l.along);
    precise float distance = dot_exactly(p, normal) / facing;
    m.distance = distance;
    m.at = sum != 0.0 ? min(vec2(u, v) / sum, 1.0) : vec2(0.0);
    m.is_along = facing > 0.0;
    return facing != 0.0 && l.near <= distance && distance <= l.far;
}

bool ends_in(inout line l, uint leaf)
{
    uint first = leaf / BD_RAY_LEAF_COUNTS, end = first + leaf % BD_RAY_LEAF_COUNTS;
    bool ends = false;
    for (uint t = first; t < end && !ends; t++) {
        uvec4 a = triangles[t * BD_RAY_TRIANGLE_UVEC4S];
        uvec4 b = triangles[t * BD_RAY_TRIANGLE_UVEC4S + 1u];
        uvec4 c = triangles[t * BD_RAY_TRIANGLE_UVEC4S + 2u];
        meeting m;
        m.number = a.w, m.cutout = b.w, m.back = c.w;
        bool is_hit = a.w != l.excluded.x && a.w != l.excluded.y &&
                     intersects_triangle(l, uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz),
                                    uintBitsToFloat(c.xyz), m);
        if (is_hit) ends = ends_at(l, m);
    }
    return ends;
}

// Of a triangle that is not opaque.
bool is_there(line l, meeting m)
{
#ifdef BD_CUTOUT
    if (m.cutout != 0u) return is_there_by_alpha(m.cutout - 1u, m.number, l.from, l.along, m.at);
#endif
    return true;
}

// Goes on from a node; leaves the node that is next, or behind the last. True: the line has ended.
bool walk(inout line l, inout uint at)
{
    uint looks = 0u;
    bool ends = false;
    while (at < args.node_count && looks < args.look_count_max && !ends) {
        uint leaf = 0u;
        while (at < args.node_count && looks < args.look_count_max && leaf == 0u) {
            uvec4 low = nodes[at * BD_RAY_NODE_UVEC4S], high = nodes[at * BD_RAY_NODE_UVEC4S + 1u];
            bool is_met = intersects_box(l, uintBitsToFloat(low.xyz), uintBitsToFloat(high.xyz));
            leaf = is_met ? high.w : 0u;
            at = is_met ? at + 1u : low.w;
            looks++;
        }
        if (leaf != 0u) ends = ends_in(l, leaf);
        looks += leaf % BD_RAY_LEAF_COUNTS + 1u;
    }
    return ends;
}

// Walks from the first node on or from where the walk stopped; true where the line has ended at a
// triangle. Without `can_hit` there is nothing to walk to.
bool walk_on(inout line l, bool can_hit, uint index)
{
    uint at = args.is_first_round == 1u ? 0u : places[index];
    bool ends = can_hit && walk(l, at);
    bool is_finished = !can_hit || ends || at >= args.node_count;
    if (!is_finished) atomicAdd(group_counts[BD_RAY_COUNT_UNFINISHED], 1u);
    places[index] = is_finished ? args.node_count : at;
    return ends;
}

// Before the invocations of a group count anything, and after: all of them call these.
void begin_counts()
{
    if (gl_LocalInvocationIndex < BD_RAY_COUNTS) group_counts[gl_LocalInvocationIndex] = 0u;
    barrier();
}

void end_counts()
{
    barrier();
    uint i = gl_LocalInvocationIndex;
    if (i < BD_RAY_COUNTS && group_counts[i] != 0u) atomicAdd(counts[i], group_counts[i]);
}
