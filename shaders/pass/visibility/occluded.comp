// Which segments something lies across: a segment an invocation (common/ray_walk.glsl).
#include "shared/bindings.h"
#include "shared/rays.h"

layout(local_size_x = 64) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_ray_walk_args args; };
layout(std430, binding = BD_STORAGE_SEGMENTS) readonly buffer segment_block { uvec4 segments[]; };
layout(std430, binding = BD_STORAGE_OCCLUDED) buffer occluded_block { uint occluded[]; };

#include "common/ray_walk.glsl"

shared uint group_bits[2];

bool ends_at(inout line l, meeting m) { return is_there(l, m); }

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

// False for one that nothing can lie across.
bool make_line(uvec4 from, uvec4 to, out line l)
{
    l.from = uintBitsToFloat(from.xyz);
    vec3 end = uintBitsToFloat(to.xyz);
    precise vec3 along = end - l.from;
    l.along = along;
    l.excluded = uvec2(from.w, to.w);
    if (!is_within_reach(l.from) || !is_within_reach(l.along)) return false;
    precise float bias = BD_RAY_BIAS * max(largest(l.from), largest(end)) / length(l.along);
    precise float far = 1.0 - bias;
    l.near = bias;
    l.far = far;
    l.per_along = inverse_of(l.along);
    return l.near < l.far;
}

bool answer(uint index)
{
    uvec4 from = segments[index * BD_SEGMENT_UVEC4S], to = segments[index * BD_SEGMENT_UVEC4S + 1u];
    bool is_asked = has_length(from.xyz, to.xyz);
    if (args.is_first_round == 1u && is_asked) atomicAdd(group_counts[BD_RAY_COUNT_ASKED], 1u);
    line l;
    bool can_hit = make_line(from, to, l) && is_asked;
    return walk_on(l, can_hit, index);
}

void main()
{
    uint index = args.first_ray + gl_GlobalInvocationID.x, place = gl_LocalInvocationID.x;
    if (place < 2u) group_bits[place] = 0u;
    begin_counts();
    if (index < args.end_ray && answer(index)) atomicOr(group_bits[place / 32u], 1u << place % 32u);
    end_counts();
    if (index >= args.end_ray || place % 32u != 0u) return;
    uint bits = group_bits[place / 32u];
    occluded[index / 32u] = args.is_first_round == 1u ? bits : occluded[index / 32u] | bits;
}
