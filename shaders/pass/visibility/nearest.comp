// What rays meet first: a ray an invocation (common/ray_walk.glsl). Of triangles at one distance the
// first by number, whichever the walk comes to first.
#include "shared/bindings.h"
#include "shared/rays.h"

layout(local_size_x = 64) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_ray_walk_args args; };
layout(std430, binding = BD_STORAGE_RAYS) readonly buffer ray_block { uvec4 rays[]; };
layout(std430, binding = BD_STORAGE_RAY_HITS) buffer hit_block { uvec4 hits[]; };

#include "common/ray_walk.glsl"

const float FAR_MOST = 3.4028235e38;

// Of this invocation's ray.
uvec4 hit = uvec4(BD_NO_TRIANGLE, 0u, 0u, 0u); // as it lies in the buffer
float hit_distance = 0.0;
float far_end = 0.0;
bool passes_backs = false;

bool is_passed(meeting m)
{
    return passes_backs && m.back == (m.is_along ? BD_RAY_BACK_BEFORE : BD_RAY_BACK_AGAINST);
}

// Where a ray ends that has met its hit.
float far_of_hit()
{
    precise float behind = hit_distance * (1.0 + BD_RAY_BEHIND);
    return min(behind, far_end);
}

bool ends_at(inout line l, meeting m)
{
    bool is_first = m.distance < hit_distance || (m.distance == hit_distance && m.number < hit.x);
    if (!is_first || is_passed(m) || !is_there(l, m)) return false;
    hit_distance = m.distance;
    l.far = far_of_hit();
    hit = uvec4(m.number, floatBitsToUint(m.at), floatBitsToUint(m.distance));
    return false;
}

// False for one that nothing can lie on.
bool make_line(uvec4 origin, uvec4 direction, uvec4 rest, out line l)
{
    l.from = uintBitsToFloat(origin.xyz);
    l.along = uintBitsToFloat(direction.xyz);
    l.excluded = uvec2(origin.w, BD_NO_TRIANGLE);
    if (!is_within_reach(l.from) || !is_within_reach(l.along)) return false;
    precise float bias = BD_RAY_BIAS * largest(l.from) / length(l.along);
    float near = uintBitsToFloat(rest.x);
    l.near = near > 0.0 ? near : bias;
    l.far = far_of_hit();
    l.per_along = inverse_of(l.along);
    return l.near < far_end && l.near <= FAR_MOST && largest(l.along) > 0.0;
}

// The walk's nearest so far, or none.
void take_hit(uint index)
{
    hit = args.is_first_round == 1u ? uvec4(BD_NO_TRIANGLE, 0u, 0u, 0u) : hits[index];
    bool is_none = hit.x == BD_NO_TRIANGLE;
    hit_distance = uintBitsToFloat(is_none ? INFINITY_BITS : hit.w);
}

void answer(uint index)
{
    uvec4 origin = rays[index * BD_RAY_UVEC4S], direction = rays[index * BD_RAY_UVEC4S + 1u];
    uvec4 rest = rays[index * BD_RAY_UVEC4S + 2u];
    far_end = uintBitsToFloat(direction.w);
    passes_backs = rest.y != 0u;
    take_hit(index);
    line l;
    bool can_hit = make_line(origin, direction, rest, l);
    if (args.is_first_round == 1u) atomicAdd(group_counts[BD_RAY_COUNT_ASKED], 1u);
    walk_on(l, can_hit, index);
    hits[index] = hit;
}

void main()
{
    uint index = args.first_ray + gl_GlobalInvocationID.x;
    begin_counts();
    if (index < args.end_ray) answer(index);
    end_counts();
}
